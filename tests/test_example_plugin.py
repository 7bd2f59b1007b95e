"""The walks of CONTRIBUTING.md: what another package offers is found, learned with, and named."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from installed_example import install_example

LEARN = """
import sys
from itertools import islice

sys.path[:0] = {paths}
from toy_robot import ROBOT, demonstrated, trial_of

from irlpilco_ros.experience.apprenticeship import task_of
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning import LearningSettings, apprenticeship, judge
from irlpilco_ros.learning.moments.gaussian import Gaussian
import dataclasses
import numpy as np

robot = dataclasses.replace(
    ROBOT, features="planar_hand", options={{"planar_hand.link": 0.4}}
)
task = task_of([demonstrated()], robot)
assert abs(task.feature_map.of(np.zeros(4))[0] - 0.8) < 1e-12
start = task.reference_states()[0, :2]

def run_trial(policy):
    return trial_of(policy, start, seed=1).rollout(robot.roles, robot.horizon)

settings = LearningSettings(
    imitation="late_matching", evaluations=6, options={{"late_matching.growth": 1.1}}
)
for iteration in islice(apprenticeship(task, settings, run_trial), 3):
    print(type(task.feature_map).__name__, judge(task, iteration.trial).rmse)
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A folder with the example, as pip installs it."""
    return install_example(tmp_path_factory.mktemp("plugin"))


def test_a_way_of_imitating_and_a_feature_of_another_package(installed):
    code = LEARN.format(paths=[str(installed), str(Path(__file__).parent)])
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    names, errors = zip(*(line.split() for line in done.stdout.splitlines()), strict=True)
    assert set(names) == {"PlanarHand"}
    assert float(errors[-1]) < float(errors[0]) / 3


def test_the_features_jacobian_is_its_derivative(installed, monkeypatch):
    monkeypatch.syspath_prepend(str(installed))
    import numpy as np
    from irlpilco_example.planar_hand import hand

    point, step = np.array([0.3, -0.8]), 1e-6
    _, jacobians = hand(point[None])
    ahead, behind = hand(point + step * np.eye(2))[0], hand(point - step * np.eye(2))[0]
    np.testing.assert_allclose(jacobians[0], (ahead - behind).T / (2.0 * step), atol=1e-8)


def test_a_policys_gradient_and_its_way_through_a_file(installed, monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(str(installed))
    import numpy as np
    from irlpilco_example.polynomial_policy import PolynomialPolicy

    from irlpilco_ros.experience.policy_file import read_policy_file, write_policy_file
    from irlpilco_ros.learning.joints import Joints
    from irlpilco_ros.learning.moments.gaussian import Gaussian
    from irlpilco_ros.learning.policies import REGISTRY

    monkeypatch.setitem(REGISTRY._loaded, "polynomial", PolynomialPolicy)
    monkeypatch.setattr(PolynomialPolicy, "kind", "polynomial", raising=False)
    rng = np.random.default_rng(0)
    policy = PolynomialPolicy(
        rng.standard_normal((2, 4)), rng.standard_normal((2, 3)), 6, 0.0, np.array([1.0, 2.0])
    )
    state = Gaussian(rng.standard_normal(4), 0.1 * np.eye(4))
    by_parameters, step = policy.mean_sensitivity(state, 2), 1e-6
    for column, unit in zip(by_parameters.T, np.eye(len(policy.parameters)), strict=True):
        ahead, behind = (
            policy.with_parameters(policy.parameters + sign * step * unit) for sign in (1, -1)
        )
        difference = ahead.moments(state, 2)[0].mean - behind.moments(state, 2)[0].mean
        np.testing.assert_allclose(column, difference / (2.0 * step), atol=1e-7)
    path = tmp_path / "policy_001.yaml"
    write_policy_file(path, policy, Joints(("a", "b")))
    again, _ = read_policy_file(path)
    assert again.to_arrays()["offset"] == 0.0  # a zero is a number like any other
    np.testing.assert_array_equal(again.parameters, policy.parameters)
