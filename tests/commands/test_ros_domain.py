"""Choosing a ROS domain."""

from __future__ import annotations

import os
import socket

import pytest

from irlpilco_ros.commands import ros_domain
from irlpilco_ros.commands.ros_domain import enter_private_domain
from irlpilco_ros.learning.errors import IrlPilcoError
from irlpilco_ros.ros.discovery import keep_to_this_host


def test_a_domain_that_is_set_is_kept():
    environment = {"ROS_DOMAIN_ID": "42", "ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}
    assert enter_private_domain(environment) == 42
    assert environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "OFF"


@pytest.mark.parametrize("given", ["seven", "-1", "233"])
def test_a_domain_that_is_none_is_refused(given):
    with pytest.raises(IrlPilcoError, match=f"ROS_DOMAIN_ID is '{given}'; expected 0 to 232"):
        enter_private_domain({"ROS_DOMAIN_ID": given})


def test_otherwise_it_is_a_free_one_on_this_computer_only():
    environment: dict[str, str] = {}
    domain = enter_private_domain(environment)
    assert 1 <= domain <= 100
    kept = {"ROS_DOMAIN_ID": str(domain)}
    keep_to_this_host(kept)
    assert environment == kept


def test_a_domain_in_use_is_passed_over(monkeypatch):
    monkeypatch.setattr(os, "getpid", lambda: 0)
    first = enter_private_domain({})
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as participant:
        participant.bind(("", 7400 + 250 * first + 10))
        assert enter_private_domain({}) != first


def test_none_is_free(monkeypatch):
    monkeypatch.setattr(ros_domain, "_is_free", lambda domain: False)
    with pytest.raises(IrlPilcoError, match="set ROS_DOMAIN_ID"):
        enter_private_domain({})
