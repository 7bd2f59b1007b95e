"""What a URDF says of a robot's joints: names, limits, and how they hang together."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from xml.etree import ElementTree

from irlpilco_ros.kinematics.errors import RobotDescriptionError

_MOVABLE = ("revolute", "continuous", "prismatic")
_XACRO = "{http://www.ros.org/wiki/xacro}"
_END_WORDS = ("tcp", "tool", "grasp", "tip", "ee", "effector", "gripper", "hand", "flange")
"""What the frame at an arm's end is usually called, the best first."""


@dataclass(frozen=True)
class UrdfJoint:
    """A joint that moves; [m] and [N] in place of [rad] and [Nm] if it slides.

    Attributes:
        name: Its name.
        kind: "revolute", "continuous" or "prismatic".
        parent: Link that it hangs from.
        child: Link that it moves.
        limits: Lowest and highest position [rad]; None if the URDF does not say, or if it turns
            without end.
        velocity: Largest speed [rad/s]; None if the URDF does not say.
        effort: Largest effort [Nm]; None if the URDF does not say.
        mimics: Joint that it follows; empty if it moves by itself.
        interfaces: What ros2_control offers to command it by; empty if the URDF does not say.
    """

    name: str
    kind: str
    parent: str
    child: str
    limits: tuple[float, float] | None = None
    velocity: float | None = None
    effort: float | None = None
    mimics: str = ""
    interfaces: tuple[str, ...] = ()

    @property
    def slides(self) -> bool:
        """Whether its positions are metres."""
        return self.kind == "prismatic"


@dataclass(frozen=True)
class Chain:
    """Joints one after the other, from where the robot branches to where it branches again.

    Attributes:
        name: What their names have in common, or what it probably is; no two have the same.
        joints: The joints, from the base outwards.
        end: Link where a tool is likely to be; empty if other chains go on from here, or if it is
            a gripper.
    """

    name: str
    joints: tuple[UrdfJoint, ...]
    end: str


class UrdfTree:
    """The joints of a URDF.

    Attributes:
        name: Of the robot.
        joints: Those that move and follow no other, from the root outwards, as they are written.
        followers: Those that follow another (mimic), or move in more than one way.
    """

    def __init__(self, urdf: str) -> None:
        """Read a robot's description.

        Raises:
            RobotDescriptionError: it is no URDF; says what is wrong with it.
        """
        robot = _robot_of(urdf)
        self.name = robot.get("name", "robot")
        links = [_name_of(link) for link in robot.findall("link")]
        elements = robot.findall("joint")
        self._below: dict[str, list[tuple[str, str]]] = {link: [] for link in links}
        roots = dict.fromkeys(links)
        for element in elements:
            name, parent, child = _name_of(element), _end(element, "parent"), _end(element, "child")
            for link in (parent, child):
                if link not in self._below:
                    raise RobotDescriptionError(
                        f"joint {name} names a link {link} that is not there"
                    )
            if child not in roots:
                raise RobotDescriptionError(f"link {child} hangs from two joints; one is {name}")
            del roots[child]
            self._below[parent].append((name, child))
        if len(roots) != 1:
            raise RobotDescriptionError(
                f"the links are no tree: roots are {', '.join(roots) or 'none'}; expected one"
            )
        interfaces = _interfaces(robot)
        moving = {
            joint.name: joint
            for element in elements
            if (joint := _joint(element, interfaces)) is not None
        }
        ordered = [moving[name] for name, _ in self._walk(next(iter(roots))) if name in moving]
        self.joints = tuple(j for j in ordered if j.kind in _MOVABLE and not j.mimics)
        self.followers = tuple(j for j in ordered if j not in self.joints)
        self._moving = set(moving)

    def chains(self, joints: Sequence[UrdfJoint]) -> tuple[Chain, ...]:
        """Return these joints as chains, in the order of their first joints.

        A joint that others follow, as a gripper's fingers do, is a chain of its own.
        """
        after: dict[str, list[UrdfJoint]] = {joint.name: [] for joint in joints}
        for joint in joints:
            after.get(self._nearest_above(joint, joints), []).append(joint)
        next_of = {
            name: following[0]
            for name, following in after.items()
            if len(following) == 1 and name not in self._led and following[0].name not in self._led
        }
        followed = {joint.name for joint in next_of.values()}
        chains: list[Chain] = []
        for first in (joint for joint in joints if joint.name not in followed):
            run = [first]
            while run[-1].name in next_of:
                run.append(next_of[run[-1].name])
            is_gripper = first.name in self._led
            goes_on = any(joint.name not in self._led for joint in after[run[-1].name])
            end = "" if goes_on or is_gripper else self._end_of(run[-1])
            name = _name_for(run, is_gripper)
            same = sum(chain.name.partition("#")[0] == name for chain in chains)
            chains.append(Chain(f"{name}#{same + 1}" if same else name, tuple(run), end))
        return tuple(chains)

    @cached_property
    def _led(self) -> set[str]:
        return {joint.mimics for joint in self.followers if joint.mimics}

    @cached_property
    def _joint_above(self) -> dict[str, tuple[str, str]]:
        """By link: the joint that it hangs from, and that joint's parent link."""
        return {
            child: (name, parent) for parent, below in self._below.items() for name, child in below
        }

    def _nearest_above(self, joint: UrdfJoint, joints: Sequence[UrdfJoint]) -> str:
        chosen = {each.name for each in joints}
        link = joint.parent
        while link in self._joint_above:
            name, link = self._joint_above[link]
            if name in chosen:
                return name
        return ""

    def _walk(self, link: str) -> list[tuple[str, str]]:
        """Return joints and their child links from a link outwards, depth first."""
        found, waiting = [], self._below[link][::-1]
        while waiting:
            found.append(waiting.pop())
            waiting += self._below[found[-1][1]][::-1]
        return found

    def _end_of(self, joint: UrdfJoint) -> str:
        """Return the link where a tool is likely to be: rigidly on the joint, named like one."""
        depths = {joint.child: 0}
        waiting = [joint.child]
        while waiting:
            link = waiting.pop(0)
            for name, child in self._below[link]:
                if name not in self._moving:
                    depths[child] = depths[link] + 1
                    waiting.append(child)
        ends = [link for link in depths if not self._below[link]]

        def rank(link: str) -> tuple[int, int]:
            words = re.split(r"[\W\d_]+", link.lower())
            places = [place for place, word in enumerate(_END_WORDS) if word in words]
            return min(places, default=len(_END_WORDS)), -depths[link]

        best = min(depths, key=rank)
        if rank(best)[0] < len(_END_WORDS):
            return best
        return ends[0] if len(ends) == 1 else joint.child


def _robot_of(urdf: str) -> ElementTree.Element:
    try:
        robot = ElementTree.fromstring(urdf)
    except ElementTree.ParseError as error:
        raise RobotDescriptionError(f"the robot's description is no XML: {error}") from error
    if robot.tag != "robot":
        raise RobotDescriptionError(
            f"the robot's description is a <{robot.tag}>; expected a URDF, which is a <robot>"
        )
    if any(str(element.tag).startswith(_XACRO) for element in robot.iter()):
        raise RobotDescriptionError(
            "it is a xacro file that is not expanded; the command xacro makes a URDF of it: "
            "xacro FILE.xacro > robot.urdf"
        )
    return robot


def _name_of(element: ElementTree.Element) -> str:
    name = element.get("name", "")
    if not name or not name.isprintable():
        raise RobotDescriptionError(f"a <{element.tag}> has the name {name!r}; expected a word")
    return name


def _end(element: ElementTree.Element, which: str) -> str:
    found = element.find(which)
    link = found.get("link") if found is not None else None
    if not link:
        raise RobotDescriptionError(f"joint {_name_of(element)} has no <{which} link=...>")
    return link


def _joint(
    element: ElementTree.Element, interfaces: dict[str, tuple[str, ...]]
) -> UrdfJoint | None:
    """Return a joint that moves, or None."""
    name, kind = _name_of(element), element.get("type", "")
    if kind == "fixed":
        return None
    limit, mimic = element.find("limit"), element.find("mimic")
    numbers = {key: _number(name, limit, key) for key in ("lower", "upper", "velocity", "effort")}
    lower, upper = numbers["lower"] or 0.0, numbers["upper"] or 0.0
    return UrdfJoint(
        name,
        kind,
        _end(element, "parent"),
        _end(element, "child"),
        (lower, upper) if lower < upper and kind != "continuous" else None,
        numbers["velocity"] or None,
        numbers["effort"] or None,
        mimic.get("joint", "") if mimic is not None else "",
        interfaces.get(name, ()),
    )


def _number(joint: str, limit: ElementTree.Element | None, key: str) -> float | None:
    text = limit.get(key) if limit is not None else None
    if text is None:
        return None
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if math.isnan(number):
        raise RobotDescriptionError(
            f"joint {joint} has the limit {key}={text!r}, which is no number"
        )
    return number if math.isfinite(number) else None


def _interfaces(robot: ElementTree.Element) -> dict[str, tuple[str, ...]]:
    """Return by joint what <ros2_control> offers to command it by."""
    return {
        joint.get("name", ""): tuple(
            each.get("name", "") for each in joint.findall("command_interface")
        )
        for control in robot.findall("ros2_control")
        for joint in control.findall("joint")
    }


def _name_for(joints: Sequence[UrdfJoint], is_gripper: bool) -> str:
    """Return what a chain's joints have in common in their names, or else what it probably is."""
    first, last = min(joint.name for joint in joints), max(joint.name for joint in joints)
    pairs = itertools.takewhile(lambda pair: pair[0] == pair[1], zip(first, last, strict=False))
    common = "".join(letter for letter, _ in pairs).rstrip("_-./ 0123456789")
    name = common.removesuffix("joint").rstrip("_-./ ") if len(joints) > 1 else ""
    return name or ("gripper" if is_gripper else "arm" if len(joints) > 2 else joints[0].name)
