"""A robot's parameters file, made from its URDF: what that says, and what it leaves to ask."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fnmatch import fnmatchcase

from irlpilco_ros.kinematics.urdf_tree import Chain, UrdfJoint, UrdfTree
from irlpilco_ros.learning.errors import InvalidSettingError

ENDLESS = 1000.0
"""Position limits of a joint that turns without end [rad]."""

_GUESSED_RANGE = {False: 3.1416, True: 0.1}  # [rad] or, if it slides, [m]
_WIDTH = 96
_PLAIN = re.compile(r"[A-Za-z_][\w./-]*")
_NO_WORDS = {"y", "n", "yes", "no", "on", "off", "true", "false", "null", "nan", "inf"}


@dataclass(frozen=True)
class RobotFile:
    """A robot's parameters file.

    Attributes:
        text: What is in it.
        chains: Its joints, as they hang together.
        questions: What the URDF does not say, and has to be looked up: a sentence for each.
    """

    text: str
    chains: tuple[Chain, ...]
    questions: tuple[str, ...]


def chosen_joints(tree: UrdfTree, wanted: Sequence[str] = ()) -> tuple[UrdfJoint, ...]:
    """Return the joints that are learned.

    Args:
        tree: The robot.
        wanted: Names, patterns such as `left_*`, or names of chains; empty for all joints.

    Raises:
        InvalidSettingError: no joint moves, or none is called like that.
    """
    if not tree.joints:
        raise InvalidSettingError("no joint of the URDF moves by itself: there is nothing to learn")
    if not wanted:
        return tree.joints
    of_chain = {chain.name: chain.joints for chain in tree.chains(tree.joints)}
    found: dict[str, UrdfJoint] = {}
    for word in wanted:
        joints = [joint for joint in tree.joints if fnmatchcase(joint.name, word)]
        joints = joints or list(of_chain.get(word, ()))
        if not joints:
            chains = ", ".join(of_chain)
            raise InvalidSettingError(
                f"the URDF has no joint {word} that moves by itself; its chains are {chains}, and "
                f"its joints {', '.join(joint.name for joint in tree.joints)}"
            )
        found.update({joint.name: joint for joint in joints})
    return tuple(found.values())


def robot_file(tree: UrdfTree, joints: Sequence[UrdfJoint], urdf: str, made_by: str) -> RobotFile:
    """Return the parameters file of these joints.

    Args:
        tree: The robot.
        joints: Those that are learned, in order.
        urdf: What the parameter `urdf` is to be: a path of the URDF.
        made_by: How it was made, for its first line.
    """
    chains = tree.chains(joints)
    ordered = [joint for chain in chains for joint in chain.joints]
    others = [joint.name for joint in tree.joints if joint not in ordered]
    questions = tuple(_questions(ordered))
    parts = [
        _head(tree, chains, others, made_by, questions),
        _joint_lists(chains, ordered),
        _commands(ordered),
        _tools(chains, urdf),
    ]
    text = "".join(f"{line}\n" for part in parts for line in part)
    return RobotFile(text, chains, questions)


def _questions(joints: Sequence[UrdfJoint]) -> Iterable[str]:
    unlimited = _names(j for j in joints if j.limits is None and j.kind != "continuous")
    if unlimited:
        yield (
            f"position_lower, position_upper of {unlimited}: the URDF has no limits; what is there "
            "is made up, and velocity_limit 0 holds still until you give them"
        )
    unknown = _names(j for j in joints if j.velocity is None and (j.limits or _turns(j)))
    if unknown:
        yield (f"velocity_limit of {unknown}: the URDF has none; 0 holds still until you give it")
    if any(joint.effort is None for joint in joints):
        without = _names(joint for joint in joints if joint.effort is None)
        yield f"effort_limit: the URDF has none for {without}; without it no effort stops the robot"
    yield (
        "acceleration_limit: no URDF has it; from the data sheet (arms of 1 m: 5 to 20 rad/s^2); "
        "without it commands may jump"
    )
    deaf = _names(j for j in joints if j.interfaces and "velocity" not in j.interfaces)
    if deaf:
        yield (
            f"{deaf}: ros2_control in this URDF offers no velocity interface; see "
            "msgs_docs/velocity_controller.commands.md"
        )


def _turns(joint: UrdfJoint) -> bool:
    return joint.kind == "continuous"


def _head(
    tree: UrdfTree,
    chains: Sequence[Chain],
    others: Sequence[str],
    made_by: str,
    questions: Sequence[str],
) -> Iterable[str]:
    yield from _comment(f"{tree.name}: made by {made_by}")
    yield "# Any node takes it: --ros-args --params-file THIS_FILE"
    yield "# Its joints, by chain:"
    for chain in chains:
        names = ", ".join(joint.name for joint in chain.joints)
        yield from _comment(f"{chain.name}: {names}", "# - ")
    if others:
        yield from _comment(f"Not learned, and not moved: {', '.join(others)}")
    if tree.followers:
        names = ", ".join(joint.name for joint in tree.followers)
        yield from _comment(f"Follow others, or move in several ways at once: {names}")
    yield "# What the URDF does not say, and you should:"
    for question in questions:
        yield from _comment(question, "# - ")


def _joint_lists(chains: Sequence[Chain], joints: Sequence[UrdfJoint]) -> Iterable[str]:
    def by_chain(value: Callable[[UrdfJoint], str]) -> list[list[str]]:
        return [[value(joint) for joint in chain.joints] for chain in chains]

    def number(joint: UrdfJoint, which: int) -> str:
        return _number(_limits(joint)[which])

    yield "/**:"
    yield "  ros__parameters:"
    yield from _list("joints", by_chain(lambda joint: _word(joint.name)))
    endless = [_word(joint.name) for joint in joints if _turns(joint)]
    if endless:
        yield from _note(
            "Turn without end: policies see sine and cosine; learn with features: joints"
        )
        yield from _list("continuous_joints", [endless])
    slides = [_word(joint.name) for joint in joints if joint.slides]
    if slides:
        yield from _list("sliding_joints", [slides])
    sliding = _names(joint for joint in joints if joint.slides)
    yield from _note(f"[rad]{f'; [m] of {sliding}' if sliding else ''}")
    yield from _list("position_lower", by_chain(lambda joint: number(joint, 0)))
    yield from _list("position_upper", by_chain(lambda joint: number(joint, 1)))
    yield from _note(f"[rad/s]{f'; [m/s] of {sliding}' if sliding else ''}")
    yield from _list("velocity_limit", by_chain(lambda joint: _number(_speed(joint))))
    yield from _note(f"[rad/s^2]{f'; [m/s^2] of {sliding}' if sliding else ''}, of commands")
    empty = by_chain(lambda _: "...")
    yield from _list("acceleration_limit", empty, "    # ")
    yield from _note(
        f"[Nm]{f'; [N] of {sliding}' if sliding else ''}; a joint state that tells a larger one "
        "stops the robot: leave it out if yours tells currents"
    )
    known = all(joint.effort is not None for joint in joints)
    yield from _list(
        "effort_limit",
        by_chain(lambda joint: "..." if joint.effort is None else _number(joint.effort)),
        "    " if known else "    # ",
    )


def _commands(joints: Sequence[UrdfJoint]) -> Iterable[str]:
    yield "    command_interface: velocity"
    yield "    control_period: 0.5   # [s] between two decisions, where learning sets no other"
    yield "    horizon: 0            # decisions per trial; 0: as many as the demonstration takes"
    if any("velocity" in joint.interfaces for joint in joints):
        yield from _note(
            "For ros2_control's JointGroupVelocityController, which takes the joints in this order "
            "(controller):"
        )
        yield "    # velocity_controller_output: true"
    elif any("position" in joint.interfaces for joint in joints):
        yield from _note("For ros2_control's JointTrajectoryController (controller):")
        yield "    # joint_trajectory_output: true"


def _tools(chains: Sequence[Chain], urdf: str) -> Iterable[str]:
    yield from _note(
        "Where the robot's tools are, needed to carry a motion over to another place; a guess: the "
        "frame at the end of each chain. tool_xyz [m] is where, in that frame, it touches things."
    )
    yield f"    urdf: {json.dumps(urdf, ensure_ascii=False)}"
    ends = [_word(chain.end) for chain in chains if chain.end]
    mark = "    " if ends else "    # "
    yield from _list("tools", [ends], mark)
    yield from _list("tool_links", [ends], mark)
    offsets = [["0.0"] * 3 for _ in ends]
    yield from _list("tool_xyz", offsets, mark)


def _limits(joint: UrdfJoint) -> tuple[float, float]:
    if _turns(joint):
        return -ENDLESS, ENDLESS
    guess = _GUESSED_RANGE[joint.slides]
    return joint.limits or (-guess, guess)


def _speed(joint: UrdfJoint) -> float:
    """Return the speed limit; 0 holds a joint still of which the URDF says too little."""
    return (joint.velocity or 0.0) if joint.limits or _turns(joint) else 0.0


def _names(joints: Iterable[UrdfJoint]) -> str:
    return ", ".join(joint.name for joint in joints)


def _number(value: float) -> str:
    """Return a number as ROS parameter files need it: with a point, without an exponent."""
    text = f"{Decimal(repr(value)):f}"
    return text if "." in text else f"{text}.0"


def _word(name: str) -> str:
    """Return a name as YAML, in quotes where it would be something else."""
    is_plain = _PLAIN.fullmatch(name) and name.lower() not in _NO_WORDS
    return name if is_plain else json.dumps(name, ensure_ascii=False)


def _list(name: str, rows: Sequence[Sequence[str]], indent: str = "    ") -> Iterable[str]:
    """Return the lines of a list, a new one for each row and where a line is full."""
    begin = f"{indent}{name}: ["
    further = indent + " " * (len(begin) - len(indent))
    lines = [line for row in rows for line in _filled(row, _WIDTH - len(begin))] or [""]
    for number, line in enumerate(lines):
        yield f"{further if number else begin}{line}{',' if number < len(lines) - 1 else ']'}"


def _filled(words: Sequence[str], width: int) -> Iterable[str]:
    """Return words with commas between them, as many in a line as fit."""
    line = ""
    for word in words:
        longer = f"{line}, {word}" if line else word
        if line and len(longer) > width:
            yield line
            longer = word
        line = longer
    if line:
        yield line


def _note(text: str) -> Iterable[str]:
    return _comment(text, "    # ", "    # ")


def _comment(text: str, first: str = "# ", further: str = "#   ") -> Iterable[str]:
    line = first
    for word in text.split(" "):
        if len(line) + len(word) > _WIDTH and line not in (first, further):
            yield line.rstrip()
            line = further
        line += f"{word} "
    yield line.rstrip()
