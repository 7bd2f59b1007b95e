"""What a URDF looks like: frames, the joints that move them, and shapes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from irlpilco_ros.kinematics.errors import RobotDescriptionError
from irlpilco_ros.kinematics.rigid_motion import pose
from irlpilco_ros.kinematics.urdf_tree import UrdfTree
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.resources import MissingResourceError, named_file
from irlpilco_ros.view.mesh_file import can_be_read

GREY = (0.6, 0.6, 0.62, 1.0)
"""Colour of what has none."""

_BONE = 0.02
"""Radius of what stands for a link that has no shapes [m]."""


@dataclass(frozen=True)
class Shape:
    """A shape on a link.

    Attributes:
        kind: "box", "cylinder", "sphere" or "mesh".
        size: Edges of a box; radius and length; radius; scale of a mesh [m].
        place: Its pose in the link's frame (4, 4) [m].
        colour: Red, green, blue and opacity, 0 to 1.
        file: The mesh.
    """

    kind: str
    size: tuple[float, ...]
    place: Array
    colour: tuple[float, ...] = GREY
    file: Path | None = None


@dataclass(frozen=True)
class Link:
    """A link, and the joint that it hangs from.

    Attributes:
        name: Its name.
        parent: Link that it hangs from; empty for the root.
        joint: Name of the joint; empty for the root.
        kind: Its type: "revolute", "prismatic", "fixed", ...
        origin: Pose of the joint in the parent's frame (4, 4) [m].
        axis: Of the joint, (3,), of length 1.
        shapes: What it looks like.
    """

    name: str
    parent: str
    joint: str
    kind: str
    origin: Array
    axis: Array
    shapes: tuple[Shape, ...]

    def moved(self, position: float) -> Array:
        """Return its pose in the parent's frame (4, 4) at a position of its joint [rad] or [m]."""
        motion = np.eye(4)
        if self.kind == "prismatic":
            motion[:3, 3] = position * self.axis
        elif self.kind in ("revolute", "continuous"):
            x, y, z = self.axis
            cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
            turn = np.sin(position) * cross + (1.0 - np.cos(position)) * cross @ cross
            motion[:3, :3] += turn
        return np.asarray(self.origin @ motion)


def links_of(urdf: str, folder: Path | None = None) -> tuple[Link, ...]:
    """Return the links, parents before their children.

    A robot without any shape that can be shown gets a bone from joint to joint: its meshes may be
    elsewhere.

    Args:
        urdf: The description.
        folder: What relative names of meshes are relative to.

    Raises:
        RobotDescriptionError: it is no URDF, or a number in it is none.
    """
    UrdfTree(urdf)  # says what is wrong with it
    robot = ElementTree.fromstring(urdf)
    colours = dict(_colours(robot))
    bodies = {str(link.get("name")): link for link in robot.findall("link")}
    hung = {joint.find("child").get("link"): joint for joint in robot.findall("joint")}  # type: ignore[union-attr]
    links: list[Link] = []
    waiting = [name for name in bodies if name not in hung]
    try:
        while waiting:
            name = waiting.pop(0)
            shapes = tuple(_shapes(bodies[name], colours, folder))
            links.append(_link(name, hung.get(name), shapes))
            waiting += [
                str(child)
                for child, joint in hung.items()
                if joint.find("parent").get("link") == name  # type: ignore[union-attr]
            ]
    except ValueError as error:
        raise RobotDescriptionError(f"a number of the URDF is none: {error}") from error
    return tuple(links) if any(link.shapes for link in links) else tuple(_with_bones(links))


def _link(name: str, joint: ElementTree.Element | None, shapes: tuple[Shape, ...]) -> Link:
    if joint is None:
        return Link(name, "", "", "fixed", np.eye(4), np.array([1.0, 0.0, 0.0]), shapes)
    parent, axis = joint.find("parent"), joint.find("axis")
    along = _numbers(axis, "xyz", (1.0, 0.0, 0.0))
    length = float(np.linalg.norm(along)) or 1.0
    return Link(
        name,
        str(parent.get("link")) if parent is not None else "",
        str(joint.get("name")),
        str(joint.get("type")),
        _origin(joint),
        np.array(along) / length,
        shapes,
    )


def _shapes(
    link: ElementTree.Element, colours: dict[str, tuple[float, ...]], folder: Path | None
) -> Iterable[Shape]:
    """Yield the shapes to look at; where none can be shown, those for collisions."""
    seen = list(_shapes_of(link, "visual", colours, folder))
    yield from seen or (
        _shapes_of(link, "collision", colours, folder) if link.findall("visual") else ()
    )


def _shapes_of(
    link: ElementTree.Element,
    purpose: str,
    colours: dict[str, tuple[float, ...]],
    folder: Path | None,
) -> Iterable[Shape]:
    for visual in link.findall(purpose):
        geometry, material = visual.find("geometry"), visual.find("material")
        if geometry is None or not len(geometry):
            continue
        colour: tuple[float, ...] = GREY
        if material is not None:
            own = _numbers(material.find("color"), "rgba", ())
            colour = tuple(own) or colours.get(str(material.get("name")), GREY)
        form, place = geometry[0], _origin(visual)
        if form.tag == "box":
            yield Shape("box", _numbers(form, "size", (0.0,) * 3), place, colour)
        elif form.tag == "sphere":
            yield Shape("sphere", (float(form.get("radius", 0.0)),), place, colour)
        elif form.tag == "cylinder":
            size = (float(form.get("radius", 0.0)), float(form.get("length", 0.0)))
            yield Shape("cylinder", size, place, colour)
        elif form.tag == "mesh":
            file = _mesh_file(str(form.get("filename", "")), folder)
            if file is not None:
                scale = _numbers(form, "scale", (1.0,) * 3)
                yield Shape("mesh", scale, place, colour, file)


def _mesh_file(name: str, folder: Path | None) -> Path | None:
    """Return where a mesh is, None if it is not there, or cannot be read."""
    try:
        path = named_file(name.removeprefix("file://"))
    except MissingResourceError:
        return None
    path = path if folder is None else folder / path
    return path if path.is_file() and can_be_read(path) else None


def _colours(robot: ElementTree.Element) -> Iterable[tuple[str, tuple[float, ...]]]:
    for material in robot.findall("material"):
        colour = _numbers(material.find("color"), "rgba", ())
        if colour:
            yield str(material.get("name")), colour


def _origin(element: ElementTree.Element) -> Array:
    origin = element.find("origin")
    still = (0.0, 0.0, 0.0)
    return pose(_numbers(origin, "xyz", still), _numbers(origin, "rpy", still))


def _numbers(
    element: ElementTree.Element | None, key: str, default: tuple[float, ...]
) -> tuple[float, ...]:
    text = element.get(key) if element is not None else None
    return tuple(float(word) for word in text.split()) if text else default


def _with_bones(links: list[Link]) -> Iterable[Link]:
    for link in links:
        bones = [
            _bone(child.origin[:3, 3])
            for child in links
            if child.parent == link.name and np.linalg.norm(child.origin[:3, 3]) > _BONE
        ]
        knob = Shape("sphere", (1.5 * _BONE,), np.eye(4))
        yield Link(
            link.name,
            link.parent,
            link.joint,
            link.kind,
            link.origin,
            link.axis,
            (knob, *bones),
        )


def _bone(end: Array) -> Shape:
    """Return a cylinder from a link's origin to a point (3,) [m] of it."""
    length = float(np.linalg.norm(end))
    along = end / length
    side = np.cross(along, [0.0, 0.0, 1.0] if abs(along[2]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    place = np.eye(4)
    place[:3, :3] = np.stack([side, np.cross(along, side), along], axis=1)
    place[:3, 3] = 0.5 * end
    return Shape("cylinder", (_BONE, length), place)
