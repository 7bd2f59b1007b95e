"""Where the links of the simulated Baxter, its table, its tools and the pile are. No ROS here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.kinematics.rigid_motion import inverse, pose_of
from sim_bridge.pile import pile_pose
from sim_bridge.robot_description import BASE, OBJECT

Array = NDArray[np.float64]


class Place(NamedTuple):
    """Where a frame is in its parent's: both names, and the pose (4, 4) [m]."""

    parent: str
    name: str
    pose: Array


class SceneFrames:
    """The frames of `scene_urdf`, from what is simulated."""

    def __init__(self, model: mujoco.MjModel) -> None:
        """Find out which frames there are, and which of them move."""
        self._model = model
        bodies = [model.body(number) for number in range(1, model.nbody)]
        links = [body for body in bodies if not _is_loose(model, body.id) and body.name != BASE]
        self._moving = [body.id for body in links if body.jntnum[0]]
        self._fixed = [body.id for body in links if not body.jntnum[0]]

    def fixed(self) -> list[Place]:
        """Return the frames that never move in their parents', the tools' points among them."""
        places = [
            Place(self._parent(number), self._name(number), self._at_rest(number))
            for number in self._fixed
        ]
        for site in map(self._model.site, range(self._model.nsite)):
            body = self._model.body(int(site.bodyid[0]))
            if body.id in (*self._moving, *self._fixed):
                places.append(Place(body.name, site.name, _pose(site.pos, site.quat)))
        return places

    def moving(self, data: mujoco.MjData, object_place: Sequence[float]) -> list[Place]:
        """Return the other frames.

        Args:
            data: The simulation's state, after a step.
            object_place: Where the pile lies, as for `pile_pose`.
        """
        places = [
            Place(self._parent(number), self._name(number), self._now(data, number))
            for number in self._moving
        ]
        return [*places, Place(BASE, OBJECT, pile_pose(object_place))]

    def _name(self, number: int) -> str:
        name: str = self._model.body(number).name
        return name

    def _parent(self, number: int) -> str:
        parent = int(self._model.body_parentid[number])
        return self._name(parent) if parent else BASE

    def _at_rest(self, number: int) -> Array:
        return _pose(self._model.body_pos[number], self._model.body_quat[number])

    def _now(self, data: mujoco.MjData, number: int) -> Array:
        parent = int(self._model.body_parentid[number])
        above, own = (
            pose_of(data.xpos[body], data.xmat[body].reshape(3, 3)) for body in (parent, number)
        )
        return np.asarray(inverse(above) @ own)


def _is_loose(model: mujoco.MjModel, number: int) -> bool:
    """Whether a body flies freely, as debris does."""
    body = model.body(number)
    first = int(body.jntadr[0])
    return bool(body.jntnum[0]) and int(model.jnt_type[first]) == mujoco.mjtJoint.mjJNT_FREE


def _pose(position: Array, quaternion: Array) -> Array:
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, quaternion)
    return pose_of(position, rotation.reshape(3, 3))
