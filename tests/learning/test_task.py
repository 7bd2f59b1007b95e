import dataclasses
from typing import Any, cast

import numpy as np
import pytest
from toy_models import DT, HORIZON, JOINTS, toy_demonstration, toy_task

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.state_layout import StateLayout
from irlpilco_ros.learning.task import Task


def test_a_task_describes_its_demonstration():
    task = toy_task()
    assert (task.horizon, task.state_size, task.control_size) == (HORIZON, 2 * JOINTS, JOINTS)
    np.testing.assert_array_equal(task.noise, [1e-3, 1e-3, 1e-2, 1e-2])
    assert task.feature_map.size == JOINTS
    assert task.policy_size == 2 * JOINTS


def test_commanded_demonstrations_give_their_own_controls():
    shown = toy_demonstration()
    controls = np.arange(1.0 * HORIZON * JOINTS).reshape(HORIZON, JOINTS) * 0.01
    task = Task((Rollout(shown.states, controls),), DT, np.full(JOINTS, 2.0))
    np.testing.assert_array_equal(task.demonstrated_controls(), controls)
    speeds = np.diff(shown.states[:, :JOINTS], axis=0) / DT
    np.testing.assert_allclose(toy_task().demonstrated_controls(), speeds)


def test_one_demonstration_spreads_as_much_as_the_noise():
    task = toy_task()
    np.testing.assert_allclose(
        task.reference_covariances()[2], (1e-3**2 + (1e-3) ** 2) * np.eye(JOINTS)
    )
    np.testing.assert_allclose(task.feature_noise(), task.reference_covariances()[2])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"demonstrations": ()}, "at least one"),
        ({"dt": 0.0}, "dt is 0.0 s"),
        ({"control_limit": np.ones(3)}, "control_limit"),
        ({"control_limit": np.array([1.0, -1.0])}, "control_limit"),
        ({"position_noise": 0.0}, "position_noise"),
        ({"feature_scale": {"m": 1.0}}, "feature_scale .* units of the features: rad"),
        ({"feature_scale": {"rad": 0.0}}, "feature_scale"),
        ({"horizon": HORIZON + 1}, f"demonstrations have {HORIZON} steps"),
        ({"layout": StateLayout(3)}, "layout is of 3 states"),
        (
            {"demonstrations": (toy_demonstration(), toy_demonstration(0, HORIZON + 1))},
            "different shapes",
        ),
    ],
)
def test_unsound_tasks_are_refused(changes, message):
    with pytest.raises(InvalidSettingError, match=message):
        dataclasses.replace(toy_task(), **changes)


@pytest.mark.parametrize(
    ("states", "controls", "message"),
    [
        (np.zeros((3, 2)), np.zeros((3, 1)), "T \\+ 1"),
        (np.zeros((1, 2)), np.zeros((0, 1)), "at least one step"),
        (np.array([[0.0], [np.nan]]), np.zeros((1, 1)), "state at step 1"),
        (np.zeros((3, 2)), np.array([[0.0], [np.nan]]), "control at step 1"),
    ],
)
def test_unsound_rollouts_are_refused(states, controls, message):
    with pytest.raises(InvalidSettingError, match=message):
        Rollout(states, controls)


def test_a_rollout_knows_whether_it_was_commanded():
    assert not toy_demonstration().commanded
    rollout = Rollout(np.arange(6.0).reshape(3, 2), np.zeros((2, 1)))
    assert rollout.commanded
    assert rollout.steps == 2
    np.testing.assert_array_equal(rollout.inputs(), [[0, 1, 0], [2, 3, 0]])
    np.testing.assert_array_equal(rollout.increments(), [[2, 2], [2, 2]])


def test_layout_extends_angles_and_predicts_differences():
    layout = StateLayout(3, (1,), (0, 3, 4), (0, 2, 3, 4), (0, 1))
    states = np.array([[1.0, 0.5, 2.0], [2.0, 0.7, 5.0]])
    np.testing.assert_allclose(layout.extend(states)[0], [1, 0.5, 2, np.sin(0.5), np.cos(0.5)])
    np.testing.assert_allclose(layout.dynamics_view(states)[1], [2, np.sin(0.7), np.cos(0.7)])
    np.testing.assert_allclose(layout.policy_view(states)[1], [2, 5, np.sin(0.7), np.cos(0.7)])
    np.testing.assert_allclose(layout.targets(states), [[1.0, 0.2, 5.0]])
    for bad in ({"angles": (3,)}, {"policy_inputs": (0, 0)}, {"differences": (-1,)}):
        with pytest.raises(InvalidSettingError, match="indices from 0"):
            StateLayout(3, **bad)


@pytest.mark.parametrize(
    "changes",
    [
        {"imitation": "guessing"},
        {"starts": ("last", "nowhere")},
        {"evaluations": 0},
        {"evaluations": 2.5},
        {"seed": "a"},
        {"starts": "last"},
        {"discount": 1.5},
        {"threads": 3},
        {"weight_floor": float("nan")},
    ],
)
def test_unsound_settings_are_refused_by_name(changes):
    with pytest.raises(InvalidSettingError, match=next(iter(changes))):
        LearningSettings(**changes)


def test_settings_take_lists_as_yaml_gives_them():
    assert LearningSettings(starts=cast(Any, ["zero"])).starts == ("zero",)
