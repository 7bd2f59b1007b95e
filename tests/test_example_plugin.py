"""The walks of CONTRIBUTING.md: what another package offers is found, learned with, and named."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

PLUGIN = Path(__file__).parent / "example_plugin"

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

robot = dataclasses.replace(ROBOT, features="planar_hand")
task = task_of([demonstrated()], robot)
start = task.reference_states()[0, :2]

def run_trial(policy):
    return trial_of(policy, start, seed=1).rollout(robot.roles, robot.horizon)

settings = LearningSettings(imitation="late_matching", evaluations=6)
for iteration in islice(apprenticeship(task, settings, run_trial), 3):
    print(type(task.feature_map).__name__, judge(task, iteration.trial).rmse)
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A folder with the example, as pip installs it."""
    target = tmp_path_factory.mktemp("site")
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*pip, "--target", str(target), str(copy(target))], check=True)
    return target


def copy(target: Path) -> Path:
    """Return a copy of the example, for building leaves files beside the sources."""
    source = target.parent / f"{target.name}_source"
    for file in sorted(PLUGIN.rglob("*")):
        if file.suffix in (".py", ".toml"):
            path = source / file.relative_to(PLUGIN)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(file.read_bytes())
    return source


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
