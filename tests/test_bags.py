"""The recordings in bags/: learning from them gives again what the recorded run found."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from irlpilco_ros.cli import main
from irlpilco_ros.experience.bag_reader import read_bag
from irlpilco_ros.experience.policy_file import read_policy_file
from irlpilco_ros.learning.joints import Joints

SWEEP = Path(__file__).parents[1] / "bags" / "sweep"


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    out = tmp_path_factory.mktemp("learned") / "run"
    words = ["--demonstration", str(SWEEP / "demonstration"), "--trials", str(SWEEP / "trials")]
    assert main(["train", *words, "--run-directory", str(out)]) == 0
    return out


def rows(folder):
    with (folder / "metrics.csv").open() as file:
        return {row["iteration"]: row for row in csv.DictReader(file)}


@pytest.mark.parametrize("iteration", [0, 1, 2])
def test_the_recorded_policies_are_found_again(learned, iteration):
    """To the rounding of another machine's linear algebra, not to the bit."""
    name = f"policy_{iteration:03d}.yaml"
    found, recorded = (read_policy_file(folder / name)[0] for folder in (learned, SWEEP))
    trial = read_bag(SWEEP / "trials" / f"{iteration:03d}")
    states = trial.rollout(Joints(trial.joint_names)).states[:-1]
    for step, state in enumerate(states):
        np.testing.assert_allclose(
            found.act(state, step), recorded.act(state, step), rtol=0.0, atol=5e-3
        )


def test_the_recorded_commands_are_those_of_the_policies():
    for iteration in range(3):
        policy = read_policy_file(SWEEP / f"policy_{iteration:03d}.yaml")[0]
        trial = read_bag(SWEEP / "trials" / f"{iteration:03d}")
        run = trial.rollout(Joints(trial.joint_names))
        for step, control in enumerate(run.controls):
            np.testing.assert_allclose(policy.act(run.states[step], step), control, atol=1e-9)


@pytest.mark.parametrize("iteration", ["0", "1", "2"])
def test_errors_and_margins_are_those_of_the_recorded_run(learned, iteration):
    found, recorded = rows(learned)[iteration], rows(SWEEP)[iteration]
    for column in ("rmse_rad", "mse", "margin", "robot_time_s"):
        assert math.isclose(float(found[column]), float(recorded[column]), rel_tol=1e-9), column


def test_learning_pays(learned):
    errors = [float(rows(learned)[iteration]["rmse_rad"]) for iteration in ("0", "1", "2")]
    assert errors[1] < 0.5 * errors[0]
    assert errors[2] < 0.5 * errors[1] + 1e-3
