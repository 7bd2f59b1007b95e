from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from report_runs import LATE, PREDICTED_LATE, demonstrated, write_run

from irlpilco_ros.experience.errors import RunDirectoryError
from irlpilco_ros.experience.path_quality import PathQuality
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.report.read_run import read_run

JOINTS = ("shoulder", "elbow")
POSITIONS = demonstrated(2, 4)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RunDirectory:
    return write_run(tmp_path_factory.mktemp("runs") / "demo", JOINTS, POSITIONS)


def test_trials_and_predictions_belong_to_the_same_iteration(run: RunDirectory) -> None:
    found = read_run(run)
    assert [i.index for i in found.iterations] == [0, 1, 2]
    assert found.iterations[0].prediction is None
    for k, iteration in enumerate(found.iterations):
        np.testing.assert_allclose(iteration.trial, POSITIONS + LATE * (k + 1), atol=1e-12)
        if k:
            expected = POSITIONS + PREDICTED_LATE * k
            np.testing.assert_allclose(iteration.prediction, expected, atol=1e-12)


def test_deviations_are_those_of_positions(run: RunDirectory) -> None:
    found = read_run(run)
    np.testing.assert_allclose(found.iterations[2].deviation, np.full(POSITIONS.shape, 2e-3))


def test_times_demonstration_and_numbers(run: RunDirectory) -> None:
    found = read_run(run)
    assert found.name == "demo"
    assert found.joints == JOINTS
    np.testing.assert_allclose(found.times, [0.0, 0.5, 1.0, 1.5, 2.0])
    np.testing.assert_allclose(found.demonstration, POSITIONS, atol=1e-12)
    assert found.last.rmse == pytest.approx(3e-3)
    assert found.last.path == PathQuality(6e-3, 27e-3, 1.25, 43.5)
    assert found.path_is_known
    assert found.computing_time == pytest.approx(1.5 + 2.5 + 3.0 + 5.0)
    assert found.last.notes == ("jitter 1e-6 was added",)
    assert found.settings["joints"] == "shoulder, elbow"


def test_replay_is_read(run: RunDirectory) -> None:
    found = read_run(run)
    assert found.replay_rmse == pytest.approx(0.02)
    np.testing.assert_allclose(found.replay, POSITIONS + 0.02, atol=1e-12)


def test_model_has_names_and_the_spread_of_the_data_it_was_trained_on(run: RunDirectory) -> None:
    model = read_run(run).model
    assert model is not None
    assert model.input_names[0] == "shoulder position"
    assert model.input_names[-1] == "elbow command"
    assert model.output_names[-1] == "elbow velocity"
    np.testing.assert_allclose(model.lengthscales, 4.0)
    # Iteration 2 learned from trials 0 and 1, without the last state of each.
    trained = np.concatenate([POSITIONS[:-1] + LATE, POSITIONS[:-1] + 2 * LATE])
    np.testing.assert_allclose(model.input_spread[:2], trained.std(axis=0))
    np.testing.assert_allclose(model.input_spread[2:], 0.0, atol=1e-12)


def test_run_without_replay_and_learning(tmp_path: Path) -> None:
    found = read_run(write_run(tmp_path / "new", JOINTS, POSITIONS, iterations=0, replay=False))
    assert found.replay is None
    assert np.isnan(found.replay_rmse)
    assert found.model is None


def test_folder_that_is_no_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RunDirectoryError, match="is no run directory"):
        read_run(RunDirectory(tmp_path))


def test_run_without_a_judged_trial_is_refused(tmp_path: Path) -> None:
    run = write_run(tmp_path / "new", JOINTS, POSITIONS, iterations=0, replay=False)
    run.metrics_file.unlink()
    with pytest.raises(RunDirectoryError, match="no judged trial yet"):
        read_run(run)


def test_configuration_without_joints_is_refused(tmp_path: Path) -> None:
    run = write_run(tmp_path / "new", JOINTS, POSITIONS, iterations=0, replay=False)
    (run.path / "config.yaml").write_text("seed: 0\n")
    with pytest.raises(RunDirectoryError, match=r"config\.yaml: joints is missing or empty"):
        read_run(run)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        *(
            (key, value)
            for key in ("joints", "continuous_joints")
            for value in (None, 3, [[1]], [1])
        ),
        ("joints", []),
        ("unactuated_joints", ["nobody"]),
        *(("horizon", value) for value in (None, -1, 2.5, True, "4", [4], float("nan"))),
        *(("control_period", value) for value in (None, 0.0, "x", float("inf"), {"a": 1})),
    ],
)
def test_a_configuration_that_makes_no_sense_is_refused_by_its_key(
    tmp_path: Path, key: str, value: object
) -> None:
    run = write_run(tmp_path / "new", JOINTS, POSITIONS, iterations=0, replay=False)
    run.configuration_file.write_text(yaml.safe_dump({**run.configuration(), key: value}))
    name = key if value != ["nobody"] else "unactuated joints nobody"
    with pytest.raises(RunDirectoryError, match=rf"config\.yaml: .*{name}"):
        read_run(run)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        (
            {"predicted_means": np.zeros((3, 4)), "predicted_covariances": np.zeros((3, 4, 4))},
            "002",
        ),
        ({"weights": np.ones(7)}, "weights of different features"),
        ({"index": np.asarray(1)}, "holds iteration 1"),
    ],
)
def test_an_iteration_that_is_none_of_this_run_is_refused(
    tmp_path: Path, changes: dict[str, np.ndarray], reason: str
) -> None:
    run = write_run(tmp_path / "run", JOINTS, POSITIONS)
    arrays: dict[str, Any] = {**run.read_iteration(2).to_arrays(), **changes}
    np.savez(run.iteration_file(2), **arrays)
    with pytest.raises(RunDirectoryError, match=reason):
        read_run(run)
