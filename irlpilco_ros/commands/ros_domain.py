"""A ROS domain that nobody else on this computer uses."""

from __future__ import annotations

import os
import socket
from collections.abc import MutableMapping

from irlpilco_ros.learning.errors import IrlPilcoError
from irlpilco_ros.ros.discovery import keep_to_this_host

FIRST_DOMAIN, LAST_DOMAIN = 1, 100
"""Domains whose ports lie below those that Linux hands out to clients."""

LAST_OF_ALL = 232
"""A higher domain would have ports beyond the last one."""

PORT_BASE, DOMAIN_PORTS, FIRST_PARTICIPANT = 7400, 250, 10
"""Where DDS puts the first participant of a domain (RTPS 9.6.2)."""


def enter_private_domain(environment: MutableMapping[str, str]) -> int:
    """Choose the domain of this process and its children, and return its number.

    A ROS_DOMAIN_ID that is set is kept. Otherwise it is the first free one, counted from this
    process's id, so that several runs started at once do not choose the same. Discovery stays on
    this computer unless somebody opens it on purpose (`keep_to_this_host`).

    Raises:
        IrlPilcoError: no domain is free, or the one that is set is none.
    """
    keep_to_this_host(environment)
    if given := environment.get("ROS_DOMAIN_ID"):
        if not (given.isdecimal() and int(given) <= LAST_OF_ALL):
            raise IrlPilcoError(f"ROS_DOMAIN_ID is {given!r}; expected 0 to {LAST_OF_ALL}")
        return int(given)
    count = LAST_DOMAIN - FIRST_DOMAIN + 1
    for offset in range(count):
        domain = FIRST_DOMAIN + (os.getpid() + offset) % count
        if _is_free(domain):
            environment["ROS_DOMAIN_ID"] = str(domain)
            return domain
    raise IrlPilcoError(
        f"no ROS domain from {FIRST_DOMAIN} to {LAST_DOMAIN} is free on this computer; "
        "set ROS_DOMAIN_ID to the one to use"
    )


def _is_free(domain: int) -> bool:
    """Return whether no participant listens in the domain: its first unicast port is free."""
    port = PORT_BASE + DOMAIN_PORTS * domain + FIRST_PARTICIPANT
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("", port))
        except OSError:
            return False
    return True
