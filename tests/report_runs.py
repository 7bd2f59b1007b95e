"""Runs for the tests of the report: small, and every number in them can be told from the others."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from irlpilco_ros.experience.metrics import MetricsRow
from irlpilco_ros.experience.path_quality import PathQuality
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.experience.trajectory_bag import write_trajectory
from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.iteration import Iteration
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.policies import LinearPolicy
from irlpilco_ros.report.run_summary import IterationSummary, ModelSummary, RunSummary

PERIOD = 0.5
LATE = 1.0e-3  # [rad] by which trial k is off, times k + 1
PREDICTED_LATE = 1.0e-4  # [rad] by which the prediction of trial k is off, times k


def demonstrated(joints: int, horizon: int) -> np.ndarray:
    """Positions of a demonstration, shape (H + 1, J) [rad]."""
    phase = np.linspace(0.0, 1.0, horizon + 1)[:, None]
    return 0.1 * np.arange(1, joints + 1) * np.sin(np.pi * phase)


def summary(joints: tuple[str, ...], iterations: int = 2, horizon: int = 4) -> RunSummary:
    """A run as the figures see it."""
    positions = demonstrated(len(joints), horizon)
    each = [_iteration(k, positions) for k in range(iterations + 1)]
    states = [f"{joint} {what}" for what in ("position", "velocity") for joint in joints]
    inputs = [*states, *(f"{joint} command" for joint in joints)]
    lengthscales = np.arange(1.0, 1.0 + len(states) * len(inputs)).reshape(len(states), -1)
    return RunSummary(
        name="test",
        joints=joints,
        times=PERIOD * np.arange(horizon + 1.0),
        demonstration=positions,
        iterations=tuple(each),
        replay=positions + 0.02,
        replay_rmse=0.02,
        model=ModelSummary(tuple(inputs), tuple(states), lengthscales, np.full(len(inputs), 2.0)),
        settings={"imitation": "feature_matching"},
        features=joints,
        demonstration_path=PathQuality(0.0, 0.0, 1.5, 1.75),
    )


def _iteration(k: int, demonstration: np.ndarray) -> IterationSummary:
    learned = k > 0
    return IterationSummary(
        index=k,
        trial=demonstration + LATE * (k + 1),
        prediction=demonstration + PREDICTED_LATE * k if learned else None,
        deviation=np.full(demonstration.shape, 0.003 * k) if learned else None,
        weights=np.full(demonstration.shape[1], 0.1 * k) if learned else None,
        rmse=LATE * (k + 1),
        mse=(LATE * (k + 1)) ** 2,
        margin=0.5 / (k + 1),
        cost=10.0 / k if learned else math.nan,
        robot_time=8.0 * (k + 1),
        model_time=1.5 * k,
        policy_time=2.5 * k,
        path=PathQuality(2 * LATE * (k + 1), 9 * LATE * (k + 1), 1.25, 43.5),
    )


def write_run(
    path: Path,
    joints: tuple[str, ...],
    positions: np.ndarray,
    iterations: int = 2,
    replay: bool = True,
) -> RunDirectory:
    """Write a run directory whose trial k is `LATE` (k + 1) off and whose velocities are zero."""
    horizon = len(positions) - 1
    bag = write_trajectory(path.parent / f"{path.name}_shown", _recorded(joints, positions, False))
    configuration = {"joints": joints, "horizon": horizon, "control_period": PERIOD, "seed": 0}
    run = RunDirectory(path)
    with run.claim(configuration, bag):
        for k in range(iterations + 1):
            found = _found(k, positions)
            if k == 0:
                run.write_policy(0, found.policy, Joints(joints))
            else:
                run.write_iteration(found, Joints(joints))
            trial = _recorded(joints, positions + LATE * (k + 1), True)
            write_trajectory(run.trials_directory, trial)
            run.append_metrics(_row(k, k, LATE * (k + 1)))
        if replay:
            write_trajectory(run.replay_directory, _recorded(joints, positions + 0.02, True))
            run.append_metrics(_row(None, 0, 0.02))
    return run


def _recorded(joints: tuple[str, ...], positions: np.ndarray, commanded: bool) -> Trajectory:
    commands = np.full(positions.shape, np.nan)
    if commanded:
        commands[:] = 0.25
        commands[-1] = 0.0
    stamps = 100.0 + PERIOD * np.arange(len(positions))
    return Trajectory(joints, stamps, positions, np.zeros_like(positions), commands)


def _row(iteration: int | None, trial: int, rmse: float) -> MetricsRow:
    k = iteration or 0
    path = (2 * rmse, 9 * rmse, 1.25, 43.5)
    return MetricsRow(
        iteration, trial, rmse, rmse**2, 0.5, 10.0, 8.0 * (k + 1), 1.5 * k, 2.5 * k, *path
    )


def _found(k: int, positions: np.ndarray) -> Iteration:
    """Return iteration k: variances k² 1e-6 of positions, and far larger ones of velocities."""
    steps, joints = positions.shape
    states = 2 * joints
    variances = np.repeat([1e-6 * k**2, 25.0], [joints, joints])
    return Iteration(
        index=k,
        policy=LinearPolicy(np.zeros((joints, states)), np.zeros(joints), np.ones(joints)),
        hyperparameters=Hyperparameters(
            np.full((states, states + joints), np.log(4.0)), np.zeros(states), np.zeros(states)
        ),
        weights=np.full(joints, 0.1 * k),
        margin=0.5,
        cost=10.0,
        predicted_means=np.hstack([positions + PREDICTED_LATE * k, np.full_like(positions, 9.0)]),
        predicted_covariances=np.tile(np.diag(variances), (steps, 1, 1)),
        evaluations=20,
        model_seconds=1.5 * k,
        policy_seconds=2.5 * k,
        notes=("jitter 1e-6 was added",) if k == 2 else (),
    )
