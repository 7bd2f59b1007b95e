"""The checks that stand between every command and the robot. No ROS here."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.control.joint_state_tracker import JointReading
from irlpilco_ros.control.motions import MotionStoppedError
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.joints import Joints, PolicyOf
from irlpilco_ros.learning.policies import Policy, check_acts

Vector = NDArray[np.float64]

REACTION_TIME = 0.1
"""How far ahead a joint's way to its limit is looked at [s]: about what a servo takes to brake."""

_ROUNDING = 1e-9


def check_reading(robot: RobotSettings, reading: JointReading) -> None:
    """Check that a state is made of finite numbers.

    Raises:
        MotionStoppedError: names the joint and its value.
    """
    for quantity, values in (("position", reading.positions), ("velocity", reading.velocities)):
        wrong = np.flatnonzero(~np.isfinite(values))
        if wrong.size:
            raise MotionStoppedError(
                f"{quantity} of joint {robot.joints[wrong[0]]} is {values[wrong[0]]}; "
                "expected a finite number"
            )


def check_positions(robot: RobotSettings, margin: float, reading: JointReading) -> None:
    """Check that no joint is beyond its position limits; by -`margin` [rad] if it is negative.

    Raises:
        MotionStoppedError: names the joint, where it is, and its limit.
    """
    leaning = max(0.0, -margin)
    above = reading.positions > robot.upper + leaning
    below = reading.positions < robot.lower - leaning
    for joint in np.flatnonzero(above | below):
        side, limit = ("upper", robot.upper) if above[joint] else ("lower", robot.lower)
        unit = robot.units[joint]
        raise MotionStoppedError(
            f"joint {robot.joints[joint]} is at {reading.positions[joint]:.4f} {unit}, beyond its "
            f"{side} limit {limit[joint]:g} {unit}; move it back by hand, and look why it "
            "went there"
        )


def check_efforts(robot: RobotSettings, reading: JointReading) -> None:
    """Check the efforts of a robot that is commanded by velocities, where they are told.

    Raises:
        MotionStoppedError: an effort is beyond the joint's `effort_limit`; names both.
    """
    if robot.command_interface != "velocity" or not robot.effort_limit or not reading.efforts.size:
        return
    limit = np.array(robot.effort_limit) * (1.0 + _ROUNDING)
    for joint in np.flatnonzero(np.abs(reading.efforts) > limit):
        raise MotionStoppedError(
            f"effort of joint {robot.joints[joint]} is {reading.efforts[joint]:.2f} Nm; its effort "
            f"limit is {robot.effort_limit[joint]:g} Nm: is something in its way?"
        )


def check_command(
    robot: RobotSettings, margin: float, reading: JointReading, values: Vector
) -> None:
    """Check a command (F,) before it goes out.

    Raises:
        MotionStoppedError: a value is not finite or beyond the joint's limit, or it drives a joint
            on that is within `margin` [rad] of its position limit, or will be in REACTION_TIME
            (within less of one that goes less than 1 rad in all).
    """
    is_effort, names = robot.command_interface == "effort", robot.roles.commanded
    for joint in np.flatnonzero(~np.isfinite(values)):
        raise MotionStoppedError(
            f"command of joint {names[joint]} is {values[joint]}; expected a finite number"
        )
    limit = robot.control_limit
    for joint in np.flatnonzero(np.abs(values) > limit * (1.0 + _ROUNDING)):
        position = robot.units[robot.roles.commanded_columns[joint]]
        unit = {"rad": "Nm", "m": "N"}[position] if is_effort else f"{position}/s"
        raise MotionStoppedError(
            f"command of joint {names[joint]} is {values[joint]:.4f} {unit}; "
            f"its {'effort' if is_effort else 'velocity'} limit is {limit[joint]:g} {unit}"
        )
    _check_way(robot, margin, reading, values)


def _check_way(robot: RobotSettings, margin: float, reading: JointReading, values: Vector) -> None:
    # An effort says nothing about where a joint moves; its measured speed does.
    going = reading.velocities.copy()
    if robot.command_interface == "velocity":
        going[robot.roles.commanded_columns] = values
    ahead = reading.positions + REACTION_TIME * reading.velocities
    margins = margin * robot.tolerance_share
    above = np.maximum(reading.positions, ahead) > robot.upper - margins
    below = np.minimum(reading.positions, ahead) < robot.lower + margins
    for joint in np.flatnonzero((above & (going > 0.0)) | (below & (going < 0.0))):
        side = "upper" if going[joint] > 0.0 else "lower"
        limit = (robot.upper if side == "upper" else robot.lower)[joint]
        unit = robot.units[joint]
        raise MotionStoppedError(
            f"joint {robot.joints[joint]} at {reading.positions[joint]:.4f} {unit} comes within "
            f"{margins[joint]:g} {unit} of its {side} limit {limit:g} {unit} and is moving on"
        )


def check_policy(
    robot: RobotSettings, policy: Policy, joints: Joints, start: tuple[float, ...] = ()
) -> None:
    """Check that a policy is one for this robot, and try it where trials start.

    Args:
        robot: The robot.
        policy: The policy.
        joints: Its joints.
        start: Position where trials start (J,) [rad]; the middle of the robot's range if unknown.

    Raises:
        InvalidSettingError: its joints are not the robot's joints in their order, its limit is
            above the robot's, or it gives no sound control at the start.
    """
    if joints.names != robot.joints:
        unknown = [joint for joint in joints.names if joint not in robot.joints]
        absent = [joint for joint in robot.joints if joint not in joints.names]
        raise InvalidSettingError(
            "policy.joints are not the controller's joints: "
            f"unknown: {', '.join(unknown) or 'none'}; missing: {', '.join(absent) or 'none'}; "
            f"expected, in this order: {', '.join(robot.joints)}"
        )
    if joints != robot.roles:
        raise InvalidSettingError(
            f"the policy takes {_listed(joints.unactuated)} for unactuated and "
            f"{_listed(joints.continuous)} for continuous; the controller's are "
            f"{_listed(robot.unactuated_joints)} and {_listed(robot.continuous_joints)} "
            "(policy.unactuated_joints, policy.continuous_joints)"
        )
    excess = np.flatnonzero(policy.control_limit > robot.control_limit * (1.0 + _ROUNDING))
    if excess.size:
        joint = int(excess[0])
        raise InvalidSettingError(
            f"policy.control_limit of joint {joints.commanded[joint]} is "
            f"{policy.control_limit[joint]:g}; expected at most the robot's limit "
            f"{robot.control_limit[joint]:g}"
        )
    position = np.array(start) if len(start) == len(joints.names) else _middle(robot)
    state = np.concatenate([position, np.zeros(len(position))])
    check_acts(policy, PolicyOf(joints, policy).view(state))


def _middle(robot: RobotSettings) -> Vector:
    middle: Vector = 0.5 * robot.lower + 0.5 * robot.upper
    return middle


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names) or "no joint"


def check_start(robot: RobotSettings, start: tuple[float, ...], margin: float) -> None:
    """Check that the robot may stand at a start position (J,) [rad]; empty means none is set.

    Raises:
        InvalidSettingError: wrong length, or a joint within `margin` [rad] of its limits (within
            less of them, if it goes less than 1 rad in all).
    """
    if not start:
        return
    if len(start) != len(robot.joints):
        raise InvalidSettingError(
            f"start_position has {len(start)} values for {len(robot.joints)} joints"
        )
    lower, upper = robot.lower, robot.upper
    margins = margin * robot.tolerance_share
    for j, (joint, position) in enumerate(zip(robot.joints, start, strict=True)):
        if not lower[j] + margins[j] <= position <= upper[j] - margins[j]:
            raise InvalidSettingError(
                f"start_position of joint {joint} is {position:g} {robot.units[j]}; expected it at "
                f"least position_margin = {margins[j]:g} {robot.units[j]} inside its limits "
                f"[{lower[j]:g}, {upper[j]:g}] {robot.units[j]}"
            )
