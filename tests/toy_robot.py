"""A robot of two joints, fast enough to learn on in a unit test, recorded as a real one is."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.experience.trajectory_bag import write_trajectory
from irlpilco_ros.learning.learning_settings import LearningSettings

JOINTS = ("shoulder", "elbow")
HORIZON = 6
PERIOD = 0.5

ROBOT = RobotSettings(
    joints=JOINTS,
    position_lower=(-2.0, -2.0),
    position_upper=(2.0, 2.0),
    velocity_limit=(1.0, 1.0),
    control_period=PERIOD,
    horizon=HORIZON,
)

ROBOT_FILE = f"""\
/**:
  ros__parameters:
    joints: [{", ".join(JOINTS)}]
    position_lower: [-2.0, -2.0]
    position_upper: [2.0, 2.0]
    velocity_limit: [1.0, 1.0]
    control_period: {PERIOD}
    horizon: {HORIZON}
"""

STAMPS = 100.0 + PERIOD * np.arange(HORIZON + 1)


def demonstrated(seed: int = 7) -> Trajectory:
    """A person moves both joints there and half way back; the seed is of the sensor noise."""
    times = PERIOD * np.arange(HORIZON + 1)
    positions = np.stack([0.4 * np.sin(0.9 * times), 0.3 - 0.3 * np.cos(0.7 * times)], axis=1)
    velocities = np.stack([0.36 * np.cos(0.9 * times), 0.21 * np.sin(0.7 * times)], axis=1)
    noise = np.random.default_rng(seed).normal(scale=4e-4, size=positions.shape)
    return Trajectory(
        JOINTS, STAMPS, positions + noise, velocities, np.full(positions.shape, np.nan)
    )


def trial_of(policy, start, seed: int, steps: int = HORIZON) -> Trajectory:
    """The robot tries a policy; it moves by 0.85 of what it is told, and its sensors are noisy."""
    rng = np.random.default_rng(seed)
    position, velocity = np.array(start, dtype=float), np.zeros(2)
    seen, commands = [], []
    for step in range(steps + 1):
        state = np.concatenate([position, velocity])
        state = state + rng.normal(scale=[4e-4, 4e-4, 5e-3, 5e-3])
        control = policy.act(state, step) if step < HORIZON else np.zeros(2)
        seen.append(state)
        commands.append(control)
        velocity = 0.85 * control
        position = position + PERIOD * velocity
    states = np.array(seen)
    return Trajectory(JOINTS, STAMPS[: steps + 1], states[:, :2], states[:, 2:], np.array(commands))


def record_demonstration(folder: Path, seed: int = 7) -> Path:
    return write_trajectory(folder, demonstrated(seed))


def record_trial(plan, folder: Path, steps: int = HORIZON) -> Path:
    """Run the trial of a plan; the noise depends on the iteration only."""
    start, iteration = plan.parameters["start_position"], plan.iteration
    trial = trial_of(iteration.policy, start, seed=iteration.index, steps=steps)
    return write_trajectory(folder, trial)


def record_run(
    folder: Path, settings: LearningSettings, trials: int, planned: bool = False
) -> Path:
    """Return a new run of so many judged trials; planned: the next policy is written, too."""
    shown = record_demonstration(folder / "shown")
    run = Apprenticeship.open(folder / "run", shown, ROBOT, settings)
    for _ in range(trials):
        plan = run.prepare()
        run.finish(record_trial(plan, run.directory.trials_directory))
    if planned:
        run.prepare()
    run.close()
    return folder / "run"
