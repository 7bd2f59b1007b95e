"""What a simulated robot looks like, as the primitive shapes of a URDF."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from irlpilco_ros.kinematics.rigid_motion import roll_pitch_yaw_of

_COLLISION = 3
"""Group of the shapes that are there for contacts alone, and not looked at."""

_BOX, _CYLINDER, _SPHERE, _CAPSULE = (
    int(mujoco.mjtGeom.mjGEOM_BOX),
    int(mujoco.mjtGeom.mjGEOM_CYLINDER),
    int(mujoco.mjtGeom.mjGEOM_SPHERE),
    int(mujoco.mjtGeom.mjGEOM_CAPSULE),
)


def visuals(
    model: mujoco.MjModel, body: mujoco._structs._MjModelBodyViews
) -> Iterable[ElementTree.Element]:
    """Return a <visual> for each shape of a body; a capsule is a cylinder between two spheres."""
    first, count = int(body.geomadr[0]), int(body.geomnum[0])
    for geom in (model.geom(number) for number in range(first, first + count)):
        if int(geom.group[0]) == _COLLISION:
            continue
        colour = model.mat_rgba[geom.matid[0]] if geom.matid[0] >= 0 else geom.rgba
        name = f"rgba {text(colour)}".replace(" ", "_").replace(".", "_")
        for shape, place in _shapes(geom):
            visual = ElementTree.Element("visual")
            visual.append(origin(place, geom.quat))
            ElementTree.SubElement(visual, "geometry").append(shape)
            material = ElementTree.SubElement(visual, "material", name=name)
            ElementTree.SubElement(material, "color", rgba=text(colour))
            yield visual


def origin(position: ArrayLike, quaternion: NDArray[np.float64]) -> ElementTree.Element:
    """Return a frame's place; MuJoCo's quaternions are w, x, y, z."""
    angles = roll_pitch_yaw_of(_matrix(quaternion))
    return ElementTree.Element("origin", xyz=text(position), rpy=text(angles))


def _matrix(quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation matrix (3, 3) of a quaternion w, x, y, z."""
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def text(numbers: ArrayLike) -> str:
    """Return numbers as a URDF has them, to 1e-12, and never -0."""
    return " ".join(f"{round(float(each), 12) + 0.0:.12g}" for each in np.atleast_1d(numbers))


def _shapes(
    geom: mujoco._structs._MjModelGeomViews,
) -> Iterable[tuple[ElementTree.Element, NDArray[np.float64]]]:
    """Return the geometry of a shape, and where it is."""
    kind, size = int(geom.type[0]), geom.size
    if kind == _BOX:
        yield ElementTree.Element("box", size=text(2.0 * size)), geom.pos
    elif kind == _SPHERE:
        yield ElementTree.Element("sphere", radius=text(size[0])), geom.pos
    elif kind in (_CYLINDER, _CAPSULE):
        radius, length = text(size[0]), text(2.0 * size[1])
        yield ElementTree.Element("cylinder", radius=radius, length=length), geom.pos
        if kind == _CAPSULE:
            axis = size[1] * _matrix(geom.quat)[:, 2]
            for end in (-axis, axis):
                yield ElementTree.Element("sphere", radius=radius), geom.pos + end
