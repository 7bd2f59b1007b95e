"""How good a recording is for a robot to learn from, for people."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.experience.demonstration_checks import checked_motions
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.motion import unwrapped
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.shown_motion import ShownMotion, Window
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.learning.numerics.arrays import Array

_SLOWEST = 0.1  # [s] between samples, for the noise to stand out of the motion


def appraisal(
    samples: Trajectory, path: Trajectory, robot: RobotSettings, window: Window = ()
) -> list[str]:
    """Return lines that say what a robot can do with a recording, as demonstration and as trial.

    Args:
        samples: What was recorded at the decisions.
        path: All that was recorded of the motion, of which a learner takes its demonstration.
        robot: The robot.
        window: Part of it to imitate, since the first sample [s]; empty for its motion.
    """
    lines = []
    if samples.commanded.any():
        lines.append(f"as a trial: {_trial(samples, robot)}")
    try:
        (shown,) = checked_motions([path], robot, window)
    except BagError as error:
        return [*lines, f"as a demonstration: refused: {error}"]
    return [*lines, f"as a demonstration: {_demonstration(shown, robot)}", *_quality(shown, robot)]


def _trial(samples: Trajectory, robot: RobotSettings) -> str:
    try:
        steps = samples.trial(robot.roles, robot.horizon or None, robot.control_period).steps
    except BagError as error:
        return f"refused: {error}"
    return f"{steps} decisions, one every {robot.control_period:g} s"


def _demonstration(shown: ShownMotion, robot: RobotSettings) -> str:
    steps, period = shown.rollout.steps, robot.control_period
    line = f"{steps} decisions of {period:g} s, from {shown.begin:.2f} s on"
    if shown.motion is not None:
        line += f"; {shown.motion.sentence()}"
    return "; ".join([line, *shown.notes])


def _quality(shown: ShownMotion, robot: RobotSettings) -> list[str]:
    samples = shown.samples
    passed = np.diff(samples.stamps)
    places = unwrapped(samples.positions, robot.joints, robot.continuous_joints)
    return [
        f"rate: {1.0 / samples.cadence:.1f} Hz; the longest time without a sample is "
        f"{passed.max():.3f} s",
        f"noise: {_noise(samples, places)}",
        f"closest to a limit: {_closest(samples.positions, robot)}",
        f"fastest: {_fastest(shown, robot)}",
    ]


def _noise(samples: Trajectory, places: Array) -> str:
    """Say how noisy the positions are: what third differences leave of a smooth motion."""
    if samples.cadence > _SLOWEST or len(samples) < 8:
        return f"not to be told from the motion at {1.0 / samples.cadence:.1f} Hz"
    third = np.diff(places, 3, axis=0)
    deviation = np.median(np.abs(third), axis=0) / 0.6745 / np.sqrt(20.0)
    worst = int(deviation.argmax())
    return f"{deviation[worst]:.5f} rad in {samples.joint_names[worst]}, the noisiest joint"


def _closest(positions: Array, robot: RobotSettings) -> str:
    below, above = positions - robot.lower, robot.upper - positions
    nearest = np.minimum(below, above).min(axis=0)
    nearest[[robot.joints.index(joint) for joint in robot.continuous_joints]] = np.inf
    joint = int(nearest.argmin())
    if not np.isfinite(nearest[joint]):
        return "no joint has one"
    side = "lower" if below[:, joint].min() < above[:, joint].min() else "upper"
    unit = robot.units[joint]
    return f"{robot.joints[joint]} comes within {nearest[joint]:.4f} {unit} of its {side} limit"


def _fastest(shown: ShownMotion, robot: RobotSettings) -> str:
    states, joints = shown.rollout.states, len(robot.joints)
    speeds = np.abs(np.diff(states[:, :joints], axis=0)).max(axis=0) / robot.control_period
    limit = np.maximum(np.array(robot.velocity_limit), 1e-9)
    joint = int((speeds / limit).argmax())
    unit = robot.units[joint]
    needed = f"{robot.joints[joint]} needs {speeds[joint]:.3f} {unit}/s between two decisions"
    return f"{needed}, its limit is {limit[joint]:g}"
