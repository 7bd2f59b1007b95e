"""One whole apprenticeship in one process: demonstration, replay, trials, iterations."""

from __future__ import annotations

import dataclasses
from itertools import islice
from typing import Any

import numpy as np

from irlpilco_ros.control.motions import ActingPolicy
from irlpilco_ros.experience.parameters_file import load_parameters_file, settings_from_parameters
from irlpilco_ros.experience.path_quality import MotionPath, path_quality
from irlpilco_ros.experience.robot_settings import RobotSettings, robot_from_parameters
from irlpilco_ros.learning import Iteration, LearningSettings, Rollout, Task, apprenticeship, judge
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.learn import weigh
from irlpilco_ros.learning.policies import Arrays, Policy, from_arrays
from irlpilco_ros.learning.starts.initial_policy import open_loop_policy
from irlpilco_ros.resources import config_file
from irlpilco_ros.studies.baxter.robots import ROBOTS
from irlpilco_ros.studies.job import Job, Result
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.episode import play_demonstration, run_episode
from sim_bridge.errors import ApproachError
from sim_bridge.joints import ARM_JOINTS
from sim_bridge.motion_files import CORNERED, load_motion
from sim_bridge.path_recorder import PathRecorder
from sim_bridge.tool_kinematics import ToolKinematics

JOINTS = len(ARM_JOINTS)
TRIAL_SECONDS = 8.0
"""Robot time of one trial of the sweep [s]."""

SEVENTH = 7
"""The iteration whose policy is put to the test: with eight trials, as many as the thesis had."""

_DECIMALS = 6
_NEXT_NOISE = 2000  # added to the seed where the simulation begins anew


def learning_job(
    experiment: str,
    condition: str,
    seed: int,
    robot: str = "default",
    settings: LearningSettings | None = None,
    iterations: int = 7,
    features: str = "joints",
    start_spread: float = 0.0,
) -> Job:
    """Return the job of learning with these settings on a robot of `ROBOTS`.

    Args:
        experiment: Folder of the result.
        condition: Folder in it.
        seed: Of the robot, its noise and learning.
        robot: "default" or "miscalibrated".
        settings: How to learn; None for the defaults. Seed and threads are set here.
        iterations: Number of learned policies, each tried once.
        features: What is imitated: "joints" [rad] or "tools" [m].
        start_spread: Least standard deviation of each state at the start that is learned for.
    """
    settings = dataclasses.replace(settings or LearningSettings(), seed=seed, threads=1)
    arguments: dict[str, Any] = {
        "robot": robot,
        "settings": settings,
        "iterations": iterations,
        "features": features,
    }
    if start_spread:
        arguments["start_spread"] = start_spread  # a result says no more than it depends on
    return Job(experiment, condition, seed, learning_run, arguments)


def folder_of(experiment: str, iterations: int, usual: int) -> str:
    """Return the folder of an experiment; another number of iterations has one of its own."""
    return experiment if iterations == usual else f"{experiment}_{iterations}"


def learning_run(
    robot: str,
    settings: LearningSettings,
    iterations: int,
    features: str,
    start_spread: float = 0.0,
) -> Result:
    """Show the sweep, replay it, and learn it; returns what every trial was like."""
    simulation = BaxterSimulation(ROBOTS[robot](settings.seed))
    kinematics = ToolKinematics()
    teacher = PathRecorder(simulation)
    shown = play_demonstration(simulation, load_motion(CORNERED), each_state=teacher.take)
    task = dataclasses.replace(sweep_task(shown, features), start_spread=start_spread)
    paths: list[dict[str, float]] = []

    def try_out(policy: Policy) -> Rollout:
        trial, path = try_policy(simulation, policy, task)
        paths.append(_quality(path, teacher.path()))
        return trial

    replay = try_out(open_loop_policy(task))
    trials: list[Rollout] = []
    rows = []
    for iteration in islice(apprenticeship(task, settings, try_out), iterations + 1):
        trials.append(iteration.trial)
        row = _row(task, kinematics, trials, iteration, settings)
        rows.append({**row, "path": paths[-1]})
    return {
        "demonstration_path": _quality(teacher.path(), teacher.path()),
        "replay_path": paths[0],
        "demonstration": shown.states.tolist(),
        "replay_rmse": joint_rmse(shown, replay),
        "replay_positions": _positions(replay),
        "replay_hands": hand_errors(kinematics, shown, replay),
        "rows": rows,
    }


def sweep_task(shown: Rollout, features: str = "joints") -> Task:
    """Return the task of imitating a sweep that was shown, by features of this name.

    Of tools it is their places alone: not how they are turned, nor the posture.
    """
    robot = baxter()
    places = dataclasses.replace(robot.tools, tool_size=0.0, posture_price=0.0)
    robot = dataclasses.replace(robot, features=features, tools=places)
    return Task((shown,), robot.control_period, robot.control_limit, robot.feature_map)


def baxter() -> RobotSettings:
    """Return the settings of config/baxter.yaml."""
    values = load_parameters_file(config_file("baxter.yaml"), "learner")
    return robot_from_parameters(values)


def thesis_settings() -> LearningSettings:
    """Return the settings of config/thesis.yaml."""
    values = load_parameters_file(config_file("thesis.yaml"), "learner")
    return settings_from_parameters(LearningSettings, values)


def joint_rmse(shown: Rollout, trial: Rollout) -> float:
    """Return the root-mean-square joint error over t = 1..H [rad]."""
    difference = trial.states[1:, :JOINTS] - shown.states[1:, :JOINTS]
    return float(np.sqrt(np.mean(difference**2)))


def hand_errors(kinematics: ToolKinematics, shown: Rollout, trial: Rollout) -> list[float]:
    """Return the RMS distance of dustpan lip and brush tip from where they were shown [m]."""
    wanted, _ = kinematics(shown.states[1:, :JOINTS])
    reached, _ = kinematics(trial.states[1:, :JOINTS])
    squares = ((reached - wanted) ** 2).reshape(len(wanted), -1, 3).sum(axis=2)
    return [float(distance) for distance in np.sqrt(squares.mean(axis=0))]


def learned_policy(result: Result) -> Policy:
    """Return the policy that a learning run came to after `SEVENTH` iterations, or its last."""
    rows = result["rows"]
    return from_arrays(rows[min(SEVENTH, len(rows) - 1)]["policy"])


def demonstration_of(result: Result) -> Rollout:
    """Return the demonstration of a learning run."""
    states = np.array(result["demonstration"])
    return Rollout(states, np.full((len(states) - 1, JOINTS), np.nan))


def try_policy(
    simulation: BaxterSimulation, policy: ActingPolicy, task: Task
) -> tuple[Rollout, MotionPath]:
    """Move to the start and run one trial; returns its ticks and its whole path.

    Arms that a wild trial before left knotted are freed, as a person would.

    Raises:
        ApproachError: the arms did not reach the start.
        MotionStoppedError: a check stopped the robot.
    """
    start, robot = task.reference_states()[0, :JOINTS], PathRecorder(simulation)
    arguments = (policy, start, task.horizon, task.dt, robot.take)
    try:
        return run_episode(simulation, *arguments), robot.path()
    except ApproachError:
        simulation.reset(_NEXT_NOISE + simulation.settings.seed)
        return run_episode(simulation, *arguments), robot.path()


def _quality(path: MotionPath, shown: MotionPath) -> dict[str, float]:
    return dataclasses.asdict(path_quality(path, [shown], Joints(tuple(ARM_JOINTS))))


def _row(
    task: Task,
    kinematics: ToolKinematics,
    trials: list[Rollout],
    iteration: Iteration,
    settings: LearningSettings,
) -> dict[str, Any]:
    shown, trial, policy = task.demonstrations[0], iteration.trial, iteration.policy
    _, margin = weigh(task, settings, trials)
    return {
        "rmse": joint_rmse(shown, trial),
        "mse": judge(task, trial).mse,
        "hands": hand_errors(kinematics, shown, trial),
        "margin": margin,
        "cost": iteration.cost if iteration.index else None,
        "evaluations": iteration.evaluations,
        "model_seconds": iteration.model_seconds,
        "policy_seconds": iteration.policy_seconds,
        "positions": _positions(trial),
        "predicted": _prediction(iteration) if iteration.index else None,
        "policy": _plain(policy.to_arrays()),
    }


def _plain(arrays: Arrays) -> dict[str, Any]:
    return {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in arrays.items()
    }


def _prediction(iteration: Iteration) -> dict[str, list[list[float]]]:
    """Return mean and deviation of the predicted positions, shape (H + 1, J) each [rad]."""
    deviations = iteration.predicted_deviations[:, :JOINTS]
    return {
        "mean": iteration.predicted_means[:, :JOINTS].round(_DECIMALS).tolist(),
        "deviation": deviations.round(_DECIMALS).tolist(),
    }


def _positions(trial: Rollout) -> list[list[float]]:
    rounded: list[list[float]] = trial.states[:, :JOINTS].round(_DECIMALS).tolist()
    return rounded
