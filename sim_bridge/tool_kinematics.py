"""Where brush tip and dustpan lip are, from joint angles: forward kinematics with its Jacobian."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_bridge.baxter_model import build_model
from sim_bridge.joints import ARM_JOINTS
from sim_bridge.simulation_settings import SimulationSettings

Array = NDArray[np.float64]

TOOL_POINTS = ("dustpan_lip", "brush_tip")
"""Sites of the model: in the left and in the right hand."""


class ToolKinematics:
    """A function of joint angles with its derivative, such as `CubatureFeatures` take."""

    size = 3 * len(TOOL_POINTS)

    def __init__(self) -> None:
        """Build the robot's model."""
        self._model = build_model(SimulationSettings())
        self._data = mujoco.MjData(self._model)
        joints = [self._model.joint(name) for name in ARM_JOINTS]
        self._qpos = np.array([joint.qposadr[0] for joint in joints])
        self._dof = np.array([joint.dofadr[0] for joint in joints])
        self._sites = [self._model.site(name).id for name in TOOL_POINTS]

    def __call__(self, points: Array) -> tuple[Array, Array]:
        """Return positions in the base frame [m] and their Jacobians [m/rad].

        Args:
            points: Joint angles (m, 14) [rad], left arm first.

        Returns:
            x, y, z of the dustpan's lip, then of the brush's tip, shape (m, 6), and their
            Jacobians, shape (m, 6, 14).
        """
        values = np.empty((len(points), self.size))
        jacobians = np.empty((len(points), self.size, len(ARM_JOINTS)))
        whole = np.zeros((3, self._model.nv))
        for value, jacobian, point in zip(values, jacobians, points, strict=True):
            self._data.qpos[self._qpos] = point
            mujoco.mj_kinematics(self._model, self._data)
            mujoco.mj_comPos(self._model, self._data)
            for number, site in enumerate(self._sites):
                rows = slice(3 * number, 3 * number + 3)
                mujoco.mj_jacSite(self._model, self._data, whole, None, site)
                value[rows] = self._data.site_xpos[site]
                jacobian[rows] = whole[:, self._dof]
        return values, jacobians
