"""Arms for the tests of kinematics: a small one, written down here, and Baxter."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.kinematics.rigid_motion import pose
from irlpilco_ros.kinematics.robot_kinematics import RobotKinematics
from irlpilco_ros.kinematics.tools import Tool

LINKS = 0.4, 0.3, 0.2
"""Lengths of the planar arm's links [m]."""

PLANAR = (
    """<?xml version="1.0"?>
<robot name="planar" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
  <link name="base"><visual><geometry><mesh filename="package://nowhere/base.stl"/></geometry>
    </visual></link>
"""
    + "".join(
        f"""
  <link name="link{k}"><collision><geometry><mesh filename="no.stl"/></geometry></collision></link>
  <joint name="joint{k}" type="revolute">
    <parent link="{f"link{k - 1}" if k else "base"}"/><child link="link{k}"/>
    <origin xyz="{LINKS[k - 1] if k else 0.0} 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-2.5" upper="2.5" effort="10" velocity="2"/>
  </joint>
"""
        for k in range(3)
    )
    + f"""
  <link name="hand"/>
  <joint name="wrist" type="fixed"><parent link="link2"/><child link="hand"/>
    <origin xyz="{LINKS[2]} 0 0" rpy="0 0 0.5"/></joint>
  <gazebo reference="hand"><material>Gazebo/Red</material></gazebo>
  <transmission name="t"><type>transmission_interface/SimpleTransmission</type></transmission>
</robot>
"""
)
"""A planar arm with three joints, as such files are: with meshes that are not here."""


def planar(offset: float = 0.0) -> RobotKinematics:
    """Return the planar arm with a pen that is so far beyond its hand [m]."""
    pen = Tool("pen", "hand", pose((offset, 0.0, 0.0)))
    return RobotKinematics(PLANAR, ("joint0", "joint1", "joint2"), [pen])


def planar_hand(positions: np.ndarray) -> np.ndarray:
    """Return x, y [m] and direction [rad] of the planar arm's hand, by trigonometry."""
    angles = np.cumsum(positions)
    reach = np.array(LINKS) @ np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.append(reach, angles[-1] + 0.5)
