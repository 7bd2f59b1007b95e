"""The recordings in bags/: learning from them gives again what the recorded runs found."""

import csv
import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from irlpilco_ros.cli import main
from irlpilco_ros.experience.bag_reader import read_path
from irlpilco_ros.experience.policy_file import read_policy_file
from irlpilco_ros.experience.trials import NEARLY_SAME_COMMAND, departure
from irlpilco_ros.learning.joints import Joints, PolicyOf

REPOSITORY = Path(__file__).parents[1]
TRIALS = {"sweep": 2, "cornered_sweep": 3}


class Recorded:
    """A run of bags/, and what is learned from its bags anew."""

    def __init__(self, name, out):
        self.bags = REPOSITORY / "bags" / name
        self.learned = out
        self.iterations = range(TRIALS[name])
        bags = ["--demonstration", str(self.bags / "demonstration")]
        bags += ["--trials", str(self.bags / "trials")]
        settings = ["--settings", str(REPOSITORY / "config" / f"{name}.yaml")]
        assert main(["train", *bags, *settings, "--run-directory", str(out)]) == 0

    def policies(self, iteration):
        """Return the policy that is found, and the one that was recorded."""
        name = f"policy_{iteration:03d}.yaml"
        return [read_policy_file(folder / name)[0] for folder in (self.learned, self.bags)]

    def trial(self, iteration, smooth=False):
        path = read_path(self.bags / "trials" / f"{iteration:03d}")
        return path.trial(Joints(path.joint_names), smooth=smooth), Joints(path.joint_names)


@pytest.fixture(scope="module", params=list(TRIALS))
def run(request, tmp_path_factory):
    return Recorded(request.param, tmp_path_factory.mktemp("learned") / "run")


def rows(folder):
    with (folder / "metrics.csv").open() as file:
        return {row["iteration"]: row for row in csv.DictReader(file)}


def test_the_recorded_policies_are_found_again(run):
    """To the rounding of another machine's linear algebra, not to the bit."""
    for iteration in run.iterations:
        trial, joints = run.trial(iteration)
        found, recorded = (PolicyOf(joints, policy) for policy in run.policies(iteration))
        for step, state in enumerate(trial.states[:-1]):
            np.testing.assert_allclose(
                found.act(state, step), recorded.act(state, step), rtol=0.0, atol=5e-3
            )


def test_the_recorded_commands_are_those_of_the_policies(run):
    for iteration in run.iterations:
        policy = run.policies(iteration)[1]
        tolerance = NEARLY_SAME_COMMAND if policy.blend else 1e-9
        assert departure(policy, *run.trial(iteration)) <= tolerance


def test_errors_and_margins_are_those_of_the_recorded_run(run):
    names = ["rmse_rad", "mse", "margin", "robot_time_s"]
    found, recorded = rows(run.learned), rows(run.bags)
    if "path_rmse_rad" in recorded["0"]:
        names += ["path_rmse_rad", "path_max_rad", "acceleration_p99", "acceleration_max"]
    for iteration in map(str, run.iterations):
        for name in names:
            values = float(found[iteration][name]), float(recorded[iteration][name])
            assert math.isclose(*values, rel_tol=1e-9), name


def test_learning_pays(run):
    errors = [float(rows(run.learned)[str(iteration)]["rmse_rad"]) for iteration in run.iterations]
    for before, after in itertools.pairwise(errors):
        assert after < 0.5 * before + 1e-3
