"""Where the links of a robot are, from its URDF: poses of tools and their Jacobians."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

import mujoco
import numpy as np

from irlpilco_ros.kinematics.errors import RobotDescriptionError
from irlpilco_ros.kinematics.rigid_motion import pose_of
from irlpilco_ros.kinematics.tools import Tool
from irlpilco_ros.learning.numerics.arrays import Array

_IRRELEVANT = {
    "link": ("visual", "collision", "inertial"),
    "joint": ("limit", "dynamics", "mimic", "calibration", "safety_controller"),
}
"""Kinematics need no meshes, which may lie elsewhere, no masses and no limits."""

_COMPILER = {"fusestatic": "false", "boundmass": "1", "boundinertia": "1"}
"""Links on fixed joints keep their names; a mass that nobody uses keeps MuJoCo content."""

_ONE_NUMBER = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


class RobotKinematics:
    """Poses of tools, as functions of the positions of joints.

    All poses are in the frame of the URDF's root link. Joints of the URDF that are not asked for
    stay at zero.

    Attributes:
        joints: Names of the J joints, in order.
        tools: The K tools.
    """

    def __init__(self, urdf: str, joints: Sequence[str], tools: Sequence[Tool]) -> None:
        """Read a robot's description.

        Args:
            urdf: Its text.
            joints: Names of the joints whose positions will be given, in order.
            tools: Whose poses are wanted.

        Raises:
            RobotDescriptionError: it is no URDF, or lacks a joint or a link.
        """
        self.joints, self.tools = tuple(joints), tuple(tools)
        self._model = _model_of(urdf)
        self._data = mujoco.MjData(self._model)
        found = [self._joint(name) for name in self.joints]
        self._qpos = np.array([joint.qposadr[0] for joint in found])
        self._dof = np.array([joint.dofadr[0] for joint in found])
        self._bodies = [self._link(tool) for tool in self.tools]
        self._whole = np.zeros((6, self._model.nv))

    def poses(self, positions: Array) -> Array:
        """Return the tools' poses (K, 4, 4) at joint positions (J,) [rad]."""
        self._data.qpos[self._qpos] = positions
        mujoco.mj_kinematics(self._model, self._data)
        links = [
            pose_of(self._data.xpos[body], self._data.xmat[body].reshape(3, 3))
            for body in self._bodies
        ]
        return np.stack([link @ tool.offset for link, tool in zip(links, self.tools, strict=True)])

    def poses_and_jacobians(self, positions: Array) -> tuple[Array, Array]:
        """Return poses, and how the tools move with the joints.

        Args:
            positions: Of the joints (J,) [rad].

        Returns:
            The poses (K, 4, 4), and for each tool its velocity [m/s] and angular velocity [rad/s]
            by the joints' velocities, in the base frame, shape (K, 6, J).
        """
        poses = self.poses(positions)
        mujoco.mj_comPos(self._model, self._data)
        jacobians = np.empty((len(self.tools), 6, len(self.joints)))
        for jacobian, tool, body in zip(jacobians, poses, self._bodies, strict=True):
            mujoco.mj_jac(
                self._model, self._data, self._whole[:3], self._whole[3:], tool[:3, 3], body
            )
            jacobian[:] = self._whole[:, self._dof]
        return poses, jacobians

    def _joint(self, name: str) -> mujoco._structs._MjModelJointViews:
        number = mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_JOINT, name)
        if number < 0 or int(self._model.jnt_type[number]) not in _ONE_NUMBER:
            known = (self._model.joint(each) for each in range(self._model.njnt))
            names = ", ".join(one.name for one in known if int(one.type[0]) in _ONE_NUMBER)
            raise RobotDescriptionError(
                f"the URDF has no joint {name} that turns or slides; it has {names or 'none'}"
            )
        return self._model.joint(number)

    def _link(self, tool: Tool) -> int:
        number: int = mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_BODY, tool.link)
        if number < 0:
            names = ", ".join(self._model.body(each).name for each in range(1, self._model.nbody))
            raise RobotDescriptionError(
                f"the tool {tool.name} is on the link {tool.link}, which the URDF has not; it has "
                f"{names}"
            )
        return number


def _model_of(urdf: str) -> mujoco.MjModel:
    try:
        robot = ElementTree.fromstring(urdf)
    except ElementTree.ParseError as error:
        raise RobotDescriptionError(f"the robot's description is no XML: {error}") from error
    if robot.tag != "robot":
        raise RobotDescriptionError(
            f"the robot's description is a <{robot.tag}>; expected a URDF, which is a <robot> "
            "(a xacro file becomes one by the command xacro)"
        )
    for kind, parts in _IRRELEVANT.items():
        for element in robot.iter(kind):
            for part in [each for each in element if each.tag in parts]:
                element.remove(part)
            if element.get("type") == "revolute":
                element.set("type", "continuous")  # MuJoCo insists on limits of the others
    for own in robot.findall("mujoco"):
        robot.remove(own)
    robot.insert(0, ElementTree.Element("mujoco"))
    ElementTree.SubElement(robot[0], "compiler", _COMPILER)
    try:
        return mujoco.MjModel.from_xml_string(ElementTree.tostring(robot, encoding="unicode"))
    except ValueError as error:
        raise RobotDescriptionError(f"the URDF cannot be read: {error}") from error
