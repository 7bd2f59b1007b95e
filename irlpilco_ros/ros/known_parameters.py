"""Which parameters the nodes of this package have, and what an unknown one may be meant for.

A file is often given to several nodes, so each of them gets parameters of the others. What no node
has is a slip of the pen, and a misspelt limit must not pass for one that is not set.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable

from irlpilco_ros.experience.policy_file import (
    BESIDE,
    HISTORY,
    JOINT_LISTS,
    PREFIX,
    policy_fields,
)
from irlpilco_ros.experience.renamed import RENAMED, advice
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.settings import declarations
from irlpilco_ros.ros.node_parameters import NODE_PARAMETERS

_OF_ROS = {"use_sim_time", "start_type_description_service"}
_PREFIXES_OF_ROS = ("qos_overrides.",)


def known_parameters() -> set[str]:
    """Return the names of the parameters of all nodes, those of extensions and of ROS included."""
    names = {*NODE_PARAMETERS, *_OF_ROS, PREFIX + "kind", *policy_fields(), *BESIDE}
    names |= {PREFIX + name for name in (HISTORY, *JOINT_LISTS)}
    for settings in (RobotSettings, LearningSettings):  # with those of extensions
        names |= set(declarations(settings))
    return names


def unknown_parameters(given: Iterable[str], own: Collection[str] = ()) -> list[str]:
    """Return one phrase for each parameter that no node has: its name, and what may be meant.

    Args:
        given: Names.
        own: More names that are known.
    """
    known = known_parameters() | set(own)
    wrong = [
        name
        for name in sorted(given)
        if name not in known and name not in RENAMED and not name.startswith(_PREFIXES_OF_ROS)
    ]
    return [f"{name} ({hint})" if (hint := meant(name, known)) else name for name in wrong]


def meant(name: str, known: Iterable[str]) -> str:
    """Return what may be meant by the name of a parameter that is not there; empty if nothing."""
    if name in RENAMED:
        return advice(name)
    present = {each: each for each in known}
    present |= {old: new for old, new in RENAMED.items() if new in present}
    near = difflib.get_close_matches(name, present, n=1)
    return f"is {present[near[0]]} meant?" if near else ""
