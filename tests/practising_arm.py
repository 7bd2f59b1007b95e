"""The planar arm as a robot that was shown a stroke beside an object, and tries it; without ROS."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from planar_arm import PLANAR

from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.experience.bag_message import BagMessage, BagTopic
from irlpilco_ros.experience.bag_reader import read_messages
from irlpilco_ros.experience.bag_writer import DurableBagWriter
from irlpilco_ros.experience.joint_state_cdr import schema
from irlpilco_ros.experience.object_pose import POSE_STAMPED, encode_pose
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.experience.trajectory_bag import write_trajectory
from irlpilco_ros.kinematics.rigid_motion import pose
from irlpilco_ros.learning.joints import PolicyOf
from irlpilco_ros.learning.learning_settings import LearningSettings

JOINTS = ("joint0", "joint1", "joint2")
PERIOD, HORIZON = 0.25, 8
OBJECT = pose((0.5, 0.4, 0.0), (0.0, 0.0, 0.2))
SPEED = np.array([0.8, 0.9, 1.1])
"""What the joints make of a commanded 1 rad/s."""

ROBOT_FILE = f"""\
/**:
  ros__parameters:
    joints: [{", ".join(JOINTS)}]
    position_lower: [-2.5, -2.5, -2.5]
    position_upper: [2.5, 2.5, 2.5]
    velocity_limit: [2.0, 2.0, 2.0]
    control_period: {PERIOD}
    horizon: {HORIZON}
    urdf: URDF
    tools: [pen]
    tool_links: [hand]
    tool_xyz: [0.0, 0.0, 0.0]
"""

ROBOT = RobotSettings(
    joints=JOINTS,
    position_lower=(-2.5,) * 3,
    position_upper=(2.5,) * 3,
    velocity_limit=(2.0,) * 3,
    control_period=PERIOD,
    horizon=HORIZON,
)

SETTINGS = LearningSettings(
    prior_mean="identified",
    policy="smooth_phase",
    command_history=1,
    repeating_errors=True,
    sensor_noise=True,
    evaluations=6,
    options={"smooth_phase.count": 6, "feature_matching.variance_weight": 0.3},
    threads=1,
)


def robot_file(folder: Path) -> Path:
    """Write the robot's parameter file and its URDF."""
    (folder / "arm.urdf").write_text(PLANAR)
    path = folder / "arm.yaml"
    path.write_text(ROBOT_FILE.replace("URDF", str(folder / "arm.urdf")))
    return path


def way(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return positions [rad] and velocities [rad/s] of the stroke at times [s]."""
    whole = PERIOD * HORIZON
    share = np.clip(times / whole, 0.0, 1.0)
    size = np.array([0.4, 0.5, -0.3])
    travelled = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    speed = 30.0 * share**2 * (1.0 - share) ** 2 / whole
    return np.array([0.2, 0.6, 0.4]) + np.outer(travelled, size), np.outer(speed, size)


def record_demonstration(folder: Path, object_pose: np.ndarray | None = OBJECT) -> Path:
    """Record the stroke at 100 Hz, and where the object is if somebody knows."""
    times = np.arange(0.0, PERIOD * HORIZON + 1e-9, 0.01)
    positions, velocities = way(times)
    noise = np.random.default_rng(0).standard_normal((2, *positions.shape))
    nothing = np.full_like(positions, np.nan)
    shown = Trajectory(
        JOINTS, 100.0 + times, positions + 4e-4 * noise[0], velocities + 5e-3 * noise[1], nothing
    )
    bag = write_trajectory(folder, shown)
    return bag if object_pose is None else with_pose(bag, object_pose)


def with_pose(bag: Path, object_pose: np.ndarray) -> Path:
    """Make a copy of a bag beside it that tells where the object is, three times, noisily."""
    definition, type_hash = schema(POSE_STAMPED)
    topic = BagTopic("/object_pose", POSE_STAMPED, definition, type_hash)
    messages = list(read_messages(bag))
    copy = bag.with_name(f"{bag.name}_with_pose")
    with DurableBagWriter(copy) as writer:
        for noise in (-0.002, 0.0, 0.002):
            seen = object_pose @ pose((noise, 0.0, 0.0))
            first = messages[0].log_time
            writer.append(BagMessage(topic, encode_pose(seen, first), first, first))
        writer.append(*messages)
    return copy


def record_trial(plan, folder: Path) -> Path:
    """Run the trial of a plan, told 100 times a second; noise depends on the iteration alone."""
    policy = PolicyOf(ROBOT.roles, plan.iteration.policy)
    rng = np.random.default_rng(plan.iteration.index)
    position = np.array(plan.parameters["start_position"])
    velocity, control = np.zeros(3), np.zeros(3)
    horizon, substeps = plan.parameters["trial_horizon"], round(PERIOD / 0.01)
    rows, steps = [], horizon * substeps
    for sample in range(steps + 1):
        noisy = position + 4e-4 * rng.standard_normal(3), velocity + 5e-3 * rng.standard_normal(3)
        command = np.full(3, np.nan)
        if sample % substeps == 0:
            step = sample // substeps
            control = policy.act(np.concatenate(noisy), step) if step < horizon else np.zeros(3)
            command = control
        rows.append((*noisy, command))
        velocity = velocity + 0.3 * (SPEED * control - velocity)
        position = position + 0.01 * velocity
    positions, velocities, commands = map(np.array, zip(*rows, strict=True))
    stamps = 200.0 + 100.0 * plan.iteration.index + 0.01 * np.arange(steps + 1)
    return write_trajectory(folder, Trajectory(JOINTS, stamps, positions, velocities, commands))


def practise(run: Apprenticeship, count: int) -> list[float]:
    """Make trials; return how far off each was [rad]."""
    errors = []
    for _ in range(count):
        plan = run.prepare()
        bag = record_trial(plan, run.directory.trials_directory)
        errors.append(run.finish(bag).row.rmse_rad)
    return errors
