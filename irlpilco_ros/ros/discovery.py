"""Who finds the nodes: this computer alone, unless somebody opens them to the network on purpose.

What this sets is read by ROS and Fast DDS when a process makes its first context; docs/security.md
says what it keeps out, and what it does not.
"""

from __future__ import annotations

from collections.abc import MutableMapping

from irlpilco_ros.resources import config_file

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
"""How far nodes look for each other: OFF, LOCALHOST, SUBNET or SYSTEM_DEFAULT."""

THIS_HOST, NETWORK, ON_PURPOSE = "LOCALHOST", "SUBNET", "SYSTEM_DEFAULT"

PROFILES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")
"""Where Fast DDS looks for a user's own profiles."""


def keep_to_this_host(environment: MutableMapping[str, str]) -> bool:
    """Keep nodes with this environment to this computer, and let them find each other quickly.

    SUBNET is no choice of the user's: whoever sources ROS 2 Jazzy has it. SYSTEM_DEFAULT, which
    reaches as far, nobody has by accident; it is kept, as LOCALHOST and OFF are. Peers that
    ROS_STATIC_PEERS names are found in any case. Profiles of the user's own are kept.

    Returns:
        Whether SUBNET was narrowed.
    """
    asked = environment.get(RANGE, "")
    if asked in ("", NETWORK):
        environment[RANGE] = THIS_HOST
    is_narrow = environment[RANGE] == THIS_HOST
    if is_narrow and not any(environment.get(name) for name in PROFILES):
        environment[PROFILES[0]] = str(config_file("quick_discovery.xml"))
    return asked == NETWORK


def warning(environment: MutableMapping[str, str]) -> str:
    """Return what somebody should know whose nodes are open to the network; empty if they are not.

    Nodes that refuse whoever has no certificate (SROS2) are not open.
    """
    is_guarded = (
        environment.get("ROS_SECURITY_ENABLE") == "true"
        and environment.get("ROS_SECURITY_STRATEGY") == "Enforce"
    )
    if environment.get(RANGE) != ON_PURPOSE or is_guarded:
        return ""
    return (
        f"whoever is on the network may command this node ({RANGE}={ON_PURPOSE}, no SROS2); "
        "docs/security.md says what to do about it"
    )
