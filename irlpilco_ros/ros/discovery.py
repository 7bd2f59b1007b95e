"""Who finds the nodes: this computer alone, unless somebody opens them to the network on purpose.

What this sets is read by ROS and Fast DDS when a process makes its first context; docs/security.md
says what it keeps out, and what it does not.
"""

from __future__ import annotations

from collections.abc import Mapping, MutableMapping
from pathlib import PurePath

from irlpilco_ros.resources import config_file

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
"""How far nodes look for each other: OFF, LOCALHOST, SUBNET or SYSTEM_DEFAULT."""

PEERS = "ROS_STATIC_PEERS"
"""Other computers whose nodes are to be found."""

PROFILES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")
"""Where Fast DDS looks for a user's own profiles."""

_PROFILE = "this_host.xml"
_THIS_HOST, _NETWORK, _ON_PURPOSE, _OFF = "LOCALHOST", "SUBNET", "SYSTEM_DEFAULT", "OFF"


def keep_to_this_host(environment: MutableMapping[str, str]) -> bool:
    """Keep nodes with this environment to this computer, and let them find each other quickly.

    SUBNET is no choice of the user's: whoever sources ROS 2 Jazzy has it. SYSTEM_DEFAULT, which
    reaches as far, nobody has by accident; it is kept, as OFF is. ROS's own LOCALHOST keeps a node
    from looking further, but whoever on the network names this computer as a peer still finds it:
    config/this_host.xml lets nobody in. It cannot be had together with peers or profiles of the
    user's own, or without Fast DDS; then it is LOCALHOST.

    Returns:
        Whether SUBNET was narrowed.
    """
    asked = environment.get(RANGE, "")
    if asked == _OFF or is_open(environment):
        return False
    environment[RANGE] = _THIS_HOST
    if _can_use_profile(environment):
        # LOCALHOST would add sockets that the network reaches to those of the profile.
        environment.update({RANGE: _ON_PURPOSE, PROFILES[0]: _profile()})
    return asked == _NETWORK


def is_open(environment: Mapping[str, str]) -> bool:
    """Return whether somebody opened nodes with this environment to the network."""
    return environment.get(RANGE) == _ON_PURPOSE and not any(
        _is_own(environment.get(name, "")) for name in PROFILES
    )


def warning(environment: Mapping[str, str]) -> str:
    """Return what somebody should know whose nodes are open to the network; empty if they are not.

    Nodes that refuse whoever has no certificate (SROS2) are not open.
    """
    is_guarded = (
        environment.get("ROS_SECURITY_ENABLE") == "true"
        and environment.get("ROS_SECURITY_STRATEGY") == "Enforce"
    )
    if not is_open(environment) or is_guarded:
        return ""
    return (
        f"whoever is on the network may command this node ({RANGE}={_ON_PURPOSE}, no SROS2); "
        "docs/security.md says what to do about it"
    )


NARROWED = (
    "only this computer finds this node, whatever ROS's own SUBNET says; "
    f"{RANGE}={_ON_PURPOSE} opens it to the network (docs/security.md)"
)
"""What somebody should know whose SUBNET was narrowed."""


def _can_use_profile(environment: Mapping[str, str]) -> bool:
    middleware = environment.get("RMW_IMPLEMENTATION", "")
    given = [profile for name in PROFILES if (profile := environment.get(name))]
    return (
        middleware in ("", "rmw_fastrtps_cpp", "rmw_fastrtps_dynamic_cpp")
        and all(map(_is_own, given))
        and not environment.get(PEERS)
        and environment.get("ROS_LOCALHOST_ONLY") != "1"  # means LOCALHOST, whatever RANGE says
    )


def _profile() -> str:
    return str(config_file(_PROFILE))


def _is_own(profile: str) -> bool:
    """Return whether it is this file, or that of another installation of this package."""
    return PurePath(profile).name == _PROFILE
