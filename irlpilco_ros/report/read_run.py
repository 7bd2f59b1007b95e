"""From the files of a run directory to what the report shows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from irlpilco_ros.experience.best_trial import best_command, best_row, command_of, rows_here
from irlpilco_ros.experience.configuration import motion_settings
from irlpilco_ros.experience.errors import RunDirectoryError
from irlpilco_ros.experience.metrics import DEMONSTRATION, REPLAY, MetricsRow
from irlpilco_ros.experience.path_quality import UNKNOWN, MotionPath, PathQuality
from irlpilco_ros.experience.robot_settings import units_of
from irlpilco_ros.experience.run_directory import WINDOW, RunDirectory
from irlpilco_ros.experience.shown_motion import ShownMotion, Wanted, shown_motions
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.iteration import Iteration
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.settings import convert
from irlpilco_ros.learning.state_layout import StateLayout
from irlpilco_ros.report.courses import TRIAL, course, course_of_trial
from irlpilco_ros.report.joint_use import JointUse, Movement, joint_uses
from irlpilco_ros.report.resimulation import can_resimulate
from irlpilco_ros.report.run_summary import (
    UNKNOWN_UNIT,
    IterationSummary,
    ModelSummary,
    RunSummary,
    all_of,
)


def read_run(run: RunDirectory) -> RunSummary:
    """Read everything that the report shows: what was practised where it was shown.

    Raises:
        RunDirectoryError: this is no run directory, or no trial of it was judged yet.
        BagError: a bag of it cannot be read.
    """
    configuration = run.configuration()
    try:
        joints = run_joints(configuration)
        wanted = run_wanted(configuration, joints)
    except InvalidSettingError as error:
        raise RunDirectoryError(f"{run.configuration_file}: {error}") from error
    rows = [row for row in run.metrics() if (row.iteration or 0) < run.moved_at]
    if not rows:
        raise RunDirectoryError(
            f"{run.path} holds no judged trial yet; there is nothing to report before the first "
            "learning iteration is over"
        )
    bags = {row.trial: run.trials_directory / f"{row.trial:03d}" for row in rows}
    motions = shown_motions(run.demonstrations(), wanted)
    shown = [each.rollout.states for each in motions]
    horizon = len(shown[0]) - 1
    trials = [run.read_trial(bags[row.trial], joints, horizon) for row in rows]
    found = {k: run.read_iteration(k) for k in run.iterations() if k < run.moved_at}
    for k, iteration in found.items():
        _check(iteration, run.iteration_file(k), (horizon + 1, 2 * len(joints.names)))
    if len({len(iteration.weights) for iteration in found.values()}) > 1:
        raise RunDirectoryError(f"{run.path}: its iterations have weights of different features")
    positions = slice(0, len(joints.names))
    replay_row = run.baseline_metrics(REPLAY)
    best = best_row(rows) or rows[-1]
    courses = _courses(run, motions[0], joints, horizon * wanted.period, bags[best.trial])
    tried, told = trials[rows.index(best)], np.mean(shown, axis=0)
    return RunSummary(
        name=run.path.name,
        joints=joints.names,
        times=np.asarray(wanted.period * np.arange(horizon + 1), dtype=np.float64),
        demonstration=told[:, positions],
        iterations=tuple(
            _iteration(row, trial.states[:, positions], found.get(row.iteration or 0))
            for row, trial in zip(rows, trials, strict=True)
        ),
        replay_rmse=math.nan if replay_row is None else replay_row.rmse_rad,
        replay=None if replay_row is None else _replay(run, replay_row, joints, horizon),
        model=_model(joints, trials, found),
        settings={key: _text(value) for key, value in configuration.items()},
        demonstrations=len(shown),
        best_command=_best_command(run, best),
        replay_path=_path(replay_row),
        demonstration_path=_path(run.baseline_metrics(DEMONSTRATION)),
        courses=courses,
        uses=_uses(joints, configuration, courses, tried, told),
        **_words(configuration, joints),
    )


def run_joints(configuration: Mapping[str, Any]) -> Joints:
    """Return the joints of a run.

    Raises:
        InvalidSettingError: its configuration names none.
    """
    names = _names(configuration, "joints")
    if not names:
        raise InvalidSettingError("joints is missing or empty; expected the names of the joints")
    return Joints(
        names,
        _names(configuration, "unactuated_joints"),
        _names(configuration, "continuous_joints"),
    )


def run_wanted(configuration: Mapping[str, Any], joints: Joints) -> Wanted:
    """Return what of the demonstrations the run imitates.

    Raises:
        InvalidSettingError: its configuration lacks something, or a value is wrong.
    """
    return Wanted(
        joints,
        _number(configuration, "control_period", int, float),
        _horizon(configuration),
        motion_settings(configuration),
        convert(WINDOW, configuration.get(WINDOW, ()), tuple[float, ...]),
    )


def _names(configuration: Mapping[str, Any], key: str) -> tuple[str, ...]:
    names = configuration.get(key, [])
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise InvalidSettingError(f"{key} is {names!r}; expected a list of names")
    return tuple(names)


def _number(configuration: Mapping[str, Any], key: str, *kinds: type[float]) -> Any:
    value: Any = configuration.get(key)
    if type(value) not in kinds or not 0 < value < math.inf:
        kind = "whole" if kinds == (int,) else "finite"
        raise InvalidSettingError(f"{key} is {value!r}; expected a {kind} number above 0")
    return value


def _horizon(configuration: Mapping[str, Any]) -> int:
    """Return the horizon that was set; 0 if it follows from the demonstration."""
    return 0 if configuration.get("horizon") == 0 else _number(configuration, "horizon", int)


def _words(configuration: Mapping[str, Any], joints: Joints) -> dict[str, Any]:
    """Return names and units, by the fields of `RunSummary`."""
    units = _units(configuration, joints)
    unit = all_of(units)
    compared = configuration.get("features", "joints")
    plain = unit in ("rad", "m") and not joints.continuous
    return {
        "continuous": joints.continuous,
        "features": _feature_names(compared, joints),
        "units": units,
        "margin_unit": f"{unit}²" if compared == "joints" and plain else "",
        "commands": "efforts"
        if configuration.get("command_interface") == "effort"
        else "velocities",
    }


def _units(configuration: Mapping[str, Any], joints: Joints) -> tuple[str, ...]:
    """Return the unit of each joint; runs of before `sliding_joints` do not know it."""
    if "sliding_joints" in configuration or can_resimulate(joints.names):
        return units_of(joints.names, _names(configuration, "sliding_joints"))
    return (UNKNOWN_UNIT,) * len(joints.names)


def _feature_names(compared: Any, joints: Joints) -> tuple[str, ...]:
    """Return the names of the features that motions are compared by; none where nobody knows."""
    if compared == "motion":
        return tuple(f"{name} {what}" for what in ("position", "velocity") for name in joints.names)
    if compared != "joints":
        return ()
    positions = [name for name in joints.names if name not in joints.continuous]
    angles = [f"{what} {name}" for name in joints.continuous for what in ("sin", "cos")]
    return (*positions, *angles)


def _check(iteration: Iteration, path: Path, shape: tuple[int, int]) -> None:
    if iteration.predicted_means.shape != shape:
        raise RunDirectoryError(
            f"{path}: the prediction has shape {iteration.predicted_means.shape}; trials of this "
            f"run have {shape}"
        )


def _iteration(row: MetricsRow, trial: np.ndarray, found: Iteration | None) -> IterationSummary:
    joints = trial.shape[1]
    prediction = deviation = weights = None
    if found is not None:
        prediction = found.predicted_means[:, :joints]
        deviation = found.predicted_deviations[:, :joints]
        weights = found.weights
    return IterationSummary(
        index=row.iteration or 0,
        trial=trial,
        prediction=prediction,
        deviation=deviation,
        weights=weights,
        rmse=row.rmse_rad,
        mse=row.mse,
        margin=row.margin,
        cost=row.cost,
        robot_time=row.robot_time_s,
        model_time=row.model_s,
        policy_time=row.policy_s,
        path=_path(row),
        notes=() if found is None else found.notes,
    )


def _path(row: MetricsRow | None) -> PathQuality:
    if row is None:
        return UNKNOWN
    return PathQuality(
        row.path_rmse_rad, row.path_max_rad, row.acceleration_p99, row.acceleration_max
    )


def _replay(run: RunDirectory, row: MetricsRow, joints: Joints, horizon: int) -> np.ndarray:
    rollout = run.read_trial(run.replay_directory / f"{row.trial:03d}", joints, horizon)
    return rollout.states[:, : len(joints.names)]


def _best_command(run: RunDirectory, best: MetricsRow) -> str:
    """Return the command that runs the policy of the best trial where it was shown."""
    here = best_row(rows_here(run))
    if here is not None and here.iteration == best.iteration:
        return best_command(run)
    # The object is elsewhere by now, and best_policy.yaml is for there.
    return command_of(run.policy_file(best.iteration or 0))


def _uses(
    joints: Joints,
    configuration: Mapping[str, Any],
    courses: Mapping[str, MotionPath],
    tried: Rollout,
    told: np.ndarray,
) -> tuple[JointUse, ...]:
    """Return what each joint used of its limits: of all that was recorded, or at the decisions."""
    count = len(joints.names)
    at_ticks = {TRIAL: tried.states, DEMONSTRATION: told}
    done, shown = (
        Movement(courses[name].positions, courses[name].velocities)
        if name in courses
        else Movement(states[:, :count], states[:, count : 2 * count])
        for name, states in at_ticks.items()
    )
    return joint_uses(joints, configuration, done, shown, tried.controls)


def _courses(
    run: RunDirectory, shown: ShownMotion, joints: Joints, seconds: float, trial: Path
) -> dict[str, MotionPath]:
    """Return what was done between the decisions; of several demonstrations, the first."""
    begin = float(shown.samples.stamps[0]) + shown.begin
    found = {
        DEMONSTRATION: course(run.demonstration_paths()[0], joints, begin, seconds),
        TRIAL: course_of_trial(run.read_path(trial), joints),
    }
    replay = run.baseline_metrics(REPLAY)
    if replay is not None:
        bag = run.replay_directory / f"{replay.trial:03d}"
        found[REPLAY] = course_of_trial(run.read_path(bag), joints)
    return {name: path for name, path in found.items() if path is not None}


def _inputs(trial: Rollout, layout: StateLayout) -> np.ndarray:
    """Return what the dynamics model saw of a trial."""
    states = layout.whole_states(trial.states, trial.controls)[:-1]
    return np.hstack([layout.dynamics_view(states), trial.controls])


def _model(
    joints: Joints, trials: list[Rollout], found: dict[int, Iteration]
) -> ModelSummary | None:
    """Return the model of the latest iteration, with the spread of the inputs it was trained on."""
    if not found:
        return None
    latest = max(found)
    lengthscales = np.exp(found[latest].hyperparameters.log_lengthscales)
    layout, controls = joints.layout, len(joints.commanded)
    seen_now = len(layout.dynamics_inputs or ()) + controls
    history = (lengthscales.shape[1] - seen_now) // controls
    layout = layout.remembering(controls, history)
    inputs = np.concatenate([_inputs(trial, layout) for trial in trials[:latest]])
    states = [f"{joint} {what}" for what in ("position", "velocity") for joint in joints.names]
    before = [
        f"{joint} command {lag} before"
        for lag in range(1, history + 1)
        for joint in joints.commanded
    ]
    angles = [f"{joint} {what}" for joint in joints.continuous for what in ("sin", "cos")]
    extended = [*states, *before, *angles]
    seen = [extended[i] for i in layout.dynamics_inputs or ()]
    commands = [f"{joint} command" for joint in joints.commanded]
    return ModelSummary(
        input_names=(*seen, *commands),
        output_names=tuple(states),
        lengthscales=lengthscales,
        input_spread=inputs.std(axis=0),
    )


def _text(value: Any) -> str:
    """Return a setting as one reads it: lists without brackets, numbers as they are."""
    return ", ".join(str(each) for each in value) if isinstance(value, list) else str(value)
