"""The URDF of a simulated robot, from the numbers of its MJCF.

    python -m sim_bridge.robot_description        # writes config/baxter.urdf and config/panda.urdf

Whatever carries a demonstration over to another place reads a URDF, as every ROS robot has one. A
simulated one gets its own from the model that is simulated, so that there is one set of numbers.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from irlpilco_ros.resources import config_directory
from sim_bridge.arm_simulation import PANDA
from sim_bridge.baxter_model import SCENE

_TYPES = {
    int(mujoco.mjtJoint.mjJNT_HINGE): "revolute",
    int(mujoco.mjtJoint.mjJNT_SLIDE): "prismatic",
}
_NO_PARTS = ("table", "dustpan", "brush", "sponge")
"""Bodies that are no links of the robot: what stands beside it, and what it holds."""


def baxter_urdf() -> str:
    """Return the URDF of Baxter; its root is `base`."""
    return urdf_of(mujoco.MjModel.from_xml_path(str(SCENE)), "baxter", "base")


def panda_urdf() -> str:
    """Return the URDF of the Panda-like arm; its root is `panda_link0`."""
    return urdf_of(mujoco.MjModel.from_xml_path(str(PANDA)), "panda", "link0", "panda_")


DESCRIPTIONS: dict[str, Callable[[], str]] = {
    "baxter.urdf": baxter_urdf,
    "panda.urdf": panda_urdf,
}
"""Files in `config/`, and what belongs into them."""


def urdf_of(model: mujoco.MjModel, name: str, root: str, prefix: str = "") -> str:
    """Return the kinematics and masses of a model as the text of a URDF.

    A joint without limits is one that nobody moves, and fixed.

    Args:
        model: A tree of bodies with a joint each at the most, through the body's own origin.
        name: Of the robot.
        root: Name of the root link; if the model has a body of that name, that one.
        prefix: What names of links begin with in the URDF, and not in the model.
    """
    robot = ElementTree.Element("robot", name=name)
    ElementTree.SubElement(robot, "link", name=prefix + root)
    for number in range(1, model.nbody):
        body = model.body(number)
        if body.name in (root, *_NO_PARTS):
            continue
        link = ElementTree.SubElement(robot, "link", name=prefix + body.name)
        if body.mass[0] > 0.0:
            link.append(_inertial(body))
        parent = model.body(body.parentid[0]).name
        joint = _joint(model, body)
        ElementTree.SubElement(
            joint, "parent", link=prefix + (root if parent == "world" else parent)
        )
        ElementTree.SubElement(joint, "child", link=prefix + body.name)
        robot.append(joint)
    ElementTree.indent(robot)
    return ElementTree.tostring(robot, encoding="unicode", xml_declaration=True) + "\n"


def _joint(model: mujoco.MjModel, body: mujoco._structs._MjModelBodyViews) -> ElementTree.Element:
    joint = model.joint(int(body.jntadr[0])) if body.jntnum[0] else None
    if joint is not None and model.jnt_limited[joint.id]:
        element = ElementTree.Element("joint", name=joint.name, type=_TYPES[int(joint.type[0])])
        ElementTree.SubElement(element, "axis", xyz=_text(joint.axis))
        element.append(_limit(model, joint))
    else:
        name = joint.name if joint is not None else f"{body.name}_fixed"
        element = ElementTree.Element("joint", name=name, type="fixed")
    element.append(_origin(body.pos, body.quat))
    return element


def _limit(model: mujoco.MjModel, joint: mujoco._structs._MjModelJointViews) -> ElementTree.Element:
    """Return a joint's limits; those of speed and torque are its motor's, if it has one."""
    speed, torque = 0.0, 0.0
    for motor in map(model.actuator, range(model.nu)):
        if motor.trnid[0] == joint.id:
            speed, torque = motor.ctrlrange[1], motor.forcerange[1]
    lower, upper = joint.range
    numbers = {"lower": lower, "upper": upper, "velocity": speed, "effort": torque}
    return ElementTree.Element("limit", {key: _text(each) for key, each in numbers.items()})


def _inertial(body: mujoco._structs._MjModelBodyViews) -> ElementTree.Element:
    element = ElementTree.Element("inertial")
    ElementTree.SubElement(element, "mass", value=_text(body.mass))
    element.append(_origin(body.ipos, body.iquat))
    inertia = dict(zip(("ixx", "iyy", "izz"), map(_text, body.inertia), strict=True))
    ElementTree.SubElement(element, "inertia", inertia, ixy="0", ixz="0", iyz="0")
    return element


def _origin(position: np.ndarray, quaternion: np.ndarray) -> ElementTree.Element:
    """Return a frame's place; MuJoCo's quaternions are w, x, y, z."""
    with warnings.catch_warnings(action="ignore"):  # one of several ways to write it will do
        angles = Rotation.from_quat(quaternion, scalar_first=True).as_euler("xyz")
    return ElementTree.Element("origin", xyz=_text(position), rpy=_text(angles))


def _text(numbers: np.ndarray | float) -> str:
    """Return numbers as a URDF has them, to 1e-12, and never -0."""
    return " ".join(f"{round(float(each), 12) + 0.0:.12g}" for each in np.atleast_1d(numbers))


def main() -> None:
    """Write the files anew."""
    for name, description in DESCRIPTIONS.items():
        path: Path = config_directory() / name
        path.write_text(description(), encoding="utf-8")


if __name__ == "__main__":
    main()
