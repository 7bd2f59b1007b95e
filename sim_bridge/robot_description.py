"""The URDF of a simulated robot, from the numbers of its MJCF.

    python -m sim_bridge.robot_description        # writes config/baxter.urdf and config/panda.urdf

Whatever carries a demonstration over to another place, or shows a robot, reads a URDF, as every
ROS robot has one. A simulated one gets its own from the model that is simulated, so that there is
one set of numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

from irlpilco_ros.resources import config_directory
from sim_bridge.arm_simulation import PANDA
from sim_bridge.baxter_model import SCENE
from sim_bridge.pile import SHOWN
from sim_bridge.urdf_shapes import origin, text, visuals

_TYPES = {
    int(mujoco.mjtJoint.mjJNT_HINGE): "revolute",
    int(mujoco.mjtJoint.mjJNT_SLIDE): "prismatic",
}
BASE = "base"
"""Root link of Baxter."""

OBJECT = "object"
"""Frame of the pile that is swept."""

_BESIDE = ("table",)
"""Bodies that are no links of the robot: what stands beside it."""

_OBJECT_RADIUS, _OBJECT_HEIGHT = 0.06, 0.01  # [m], of what stands for the pile


def baxter_urdf() -> str:
    """Return the URDF of Baxter; its root is `base`."""
    return urdf_of(mujoco.MjModel.from_xml_path(str(SCENE)), "baxter", BASE)


def scene_urdf() -> str:
    """Return the URDF of Baxter at its table, with the object that it sweeps, to be looked at.

    Links besides the robot's: `table`, and `object`, which floats where the pile lies.
    """
    robot = _robot_of(mujoco.MjModel.from_xml_path(str(SCENE)), "baxter", BASE, beside=())
    link = ElementTree.SubElement(robot, "link", name=OBJECT)
    visual = ElementTree.SubElement(link, "visual")
    shape = ElementTree.SubElement(visual, "geometry")
    radius, height = text(_OBJECT_RADIUS), text(_OBJECT_HEIGHT)
    ElementTree.SubElement(shape, "cylinder", radius=radius, length=height)
    material = ElementTree.SubElement(visual, "material", name=OBJECT)
    ElementTree.SubElement(material, "color", rgba="0.9 0.6 0.1 0.6")
    joint = ElementTree.SubElement(robot, "joint", name=f"{OBJECT}_place", type="floating")
    joint.append(origin(SHOWN[:3, 3], np.array([1.0, 0.0, 0.0, 0.0])))
    _connect(joint, BASE, OBJECT)
    return _written(robot)


def panda_urdf() -> str:
    """Return the URDF of the Panda-like arm; its root is `panda_link0`."""
    return urdf_of(mujoco.MjModel.from_xml_path(str(PANDA)), "panda", "link0", "panda_")


DESCRIPTIONS: dict[str, Callable[[], str]] = {
    "baxter.urdf": baxter_urdf,
    "panda.urdf": panda_urdf,
}
"""Files in `config/`, and what belongs into them."""


def urdf_of(model: mujoco.MjModel, name: str, root: str, prefix: str = "") -> str:
    """Return kinematics, masses and looks of a model as the text of a URDF.

    A joint without limits is one that nobody moves, and fixed. What the robot holds belongs to it;
    sites are links without a mass.

    Args:
        model: A tree of bodies with a joint each at the most, through the body's own origin.
        name: Of the robot.
        root: Name of the root link; if the model has a body of that name, that one.
        prefix: What names of links begin with in the URDF, and not in the model.
    """
    return _written(_robot_of(model, name, root, prefix))


def _robot_of(
    model: mujoco.MjModel,
    name: str,
    root: str,
    prefix: str = "",
    beside: tuple[str, ...] = _BESIDE,
) -> ElementTree.Element:
    robot = ElementTree.Element("robot", name=name)
    ElementTree.SubElement(robot, "link", name=prefix + root)
    bodies = [model.body(number) for number in range(1, model.nbody)]
    for body in (body for body in bodies if body.name not in (root, *beside)):
        link = ElementTree.SubElement(robot, "link", name=prefix + body.name)
        if body.mass[0] > 0.0:
            link.append(_inertial(body))
        link.extend(visuals(model, body))
        parent = model.body(body.parentid[0]).name
        joint = _joint(model, body)
        _connect(joint, prefix + (root if parent == "world" else parent), prefix + body.name)
        robot.append(joint)
        for site in _sites(model, body):
            point = f"{site.name}_point" if site.name == body.name else site.name
            ElementTree.SubElement(robot, "link", name=prefix + point)
            joint = ElementTree.SubElement(robot, "joint", name=f"{point}_fixed", type="fixed")
            joint.append(origin(site.pos, site.quat))
            _connect(joint, prefix + body.name, prefix + point)
    return robot


def _sites(
    model: mujoco.MjModel, body: mujoco._structs._MjModelBodyViews
) -> list[mujoco._structs._MjModelSiteViews]:
    sites = (model.site(number) for number in range(model.nsite))
    return [site for site in sites if site.bodyid[0] == body.id]


def _connect(joint: ElementTree.Element, parent: str, child: str) -> None:
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)


def _written(robot: ElementTree.Element) -> str:
    ElementTree.indent(robot)
    return ElementTree.tostring(robot, encoding="unicode", xml_declaration=True) + "\n"


def _joint(model: mujoco.MjModel, body: mujoco._structs._MjModelBodyViews) -> ElementTree.Element:
    joint = model.joint(int(body.jntadr[0])) if body.jntnum[0] else None
    if joint is not None and model.jnt_limited[joint.id]:
        element = ElementTree.Element("joint", name=joint.name, type=_TYPES[int(joint.type[0])])
        ElementTree.SubElement(element, "axis", xyz=text(joint.axis))
        element.append(_limit(model, joint))
    else:
        name = joint.name if joint is not None else f"{body.name}_fixed"
        element = ElementTree.Element("joint", name=name, type="fixed")
    element.append(origin(body.pos, body.quat))
    return element


def _limit(model: mujoco.MjModel, joint: mujoco._structs._MjModelJointViews) -> ElementTree.Element:
    """Return a joint's limits; those of speed and torque are its motor's, if it has one."""
    speed, torque = 0.0, 0.0
    for motor in map(model.actuator, range(model.nu)):
        if motor.trnid[0] == joint.id:
            speed, torque = motor.ctrlrange[1], motor.forcerange[1]
    lower, upper = joint.range
    numbers = {"lower": lower, "upper": upper, "velocity": speed, "effort": torque}
    return ElementTree.Element("limit", {key: text(each) for key, each in numbers.items()})


def _inertial(body: mujoco._structs._MjModelBodyViews) -> ElementTree.Element:
    element = ElementTree.Element("inertial")
    ElementTree.SubElement(element, "mass", value=text(body.mass))
    element.append(origin(body.ipos, body.iquat))
    inertia = dict(zip(("ixx", "iyy", "izz"), map(text, body.inertia), strict=True))
    ElementTree.SubElement(element, "inertia", inertia, ixy="0", ixz="0", iyz="0")
    return element


def main() -> None:
    """Write the files anew."""
    for name, description in DESCRIPTIONS.items():
        path: Path = config_directory() / name
        path.write_text(description(), encoding="utf-8")


if __name__ == "__main__":
    main()
