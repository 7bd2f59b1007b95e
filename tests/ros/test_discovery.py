"""Who finds a node: this computer alone, unless somebody opens it on purpose."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from irlpilco_ros.ros.discovery import PROFILES, RANGE, keep_to_this_host, warning

MINIMAL = str(Path(__file__).with_name("minimal_node.py"))


@pytest.mark.parametrize(
    ("asked", "got"),
    [
        (None, "LOCALHOST"),
        ("", "LOCALHOST"),
        ("SUBNET", "LOCALHOST"),  # what ROS's own setup.bash says to everybody
        ("LOCALHOST", "LOCALHOST"),
        ("OFF", "OFF"),
        ("SYSTEM_DEFAULT", "SYSTEM_DEFAULT"),
    ],
)
def test_a_range_is_kept_if_it_is_a_choice(asked, got):
    environment = {} if asked is None else {RANGE: asked}
    assert keep_to_this_host(environment) == (asked == "SUBNET")
    assert environment[RANGE] == got


def test_nodes_of_one_host_find_each_other_quickly(repository):
    environment: dict[str, str] = {}
    keep_to_this_host(environment)
    assert environment[PROFILES[0]] == str(repository / "config/quick_discovery.xml")


@pytest.mark.parametrize("name", PROFILES)
def test_profiles_of_ones_own_are_kept(name):
    environment = {name: "mine.xml"}
    keep_to_this_host(environment)
    assert environment == {name: "mine.xml", RANGE: "LOCALHOST"}


def test_a_network_is_not_flooded_with_announcements():
    environment = {RANGE: "SYSTEM_DEFAULT"}
    keep_to_this_host(environment)
    assert environment == {RANGE: "SYSTEM_DEFAULT"}


def test_an_open_node_is_warned_of_unless_strangers_are_refused():
    guarded = {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_STRATEGY": "Enforce"}
    assert "may command this node" in warning({RANGE: "SYSTEM_DEFAULT"})
    assert "may command" in warning(
        {RANGE: "SYSTEM_DEFAULT", **guarded, "ROS_SECURITY_STRATEGY": ""}
    )
    assert not warning({RANGE: "SYSTEM_DEFAULT", **guarded})
    assert not warning({RANGE: "LOCALHOST"})


def listens_to_the_network(domain: int) -> bool:
    """Return whether anybody listens where all nodes of a network announce themselves."""
    port = 7400 + 250 * domain
    sockets = Path("/proc/net/udp").read_text().splitlines()[1:]
    return any(int(line.split()[1].rpartition(":")[2], 16) == port for line in sockets)


@pytest.mark.dds
@pytest.mark.parametrize(
    ("asked", "is_open", "said"),
    [
        ("", False, ""),
        ("SUBNET", False, "only this computer finds this node"),
        ("SYSTEM_DEFAULT", True, "whoever is on the network may command this node"),
    ],
)
def test_a_node_listens_to_the_network_only_if_it_is_told_to(ros, asked, is_open, said):
    ros.environment[RANGE] = asked
    process = ros.run([sys.executable, MINIMAL])
    ros.wait_for_node("minimal", process)
    assert listens_to_the_network(ros.domain) == is_open
    ros.wait_for(lambda: said in process.output, said)
    assert bool(said) == ("computer" in process.output or "network" in process.output)
