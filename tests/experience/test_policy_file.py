from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml

from irlpilco_ros.experience.parameters_file import load_parameters_file
from irlpilco_ros.experience.policy_file import (
    policy_fields,
    policy_from_parameters,
    policy_to_parameters,
    read_policy_file,
    write_policy_file,
)
from irlpilco_ros.learning import policies
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.policies import RbfPolicy

JOINTS = ("left", "right", "waist")
ALL = Joints(JOINTS)
random = np.random.default_rng(3)
LIMIT = np.array([0.5, 1.0, 1.5])
EXAMPLES: dict[str, dict[str, Any]] = {
    "linear": {"weights": (3, 6), "bias": (3,)},
    "linear_phase": {"weights": (3, 6), "phase_weights": (3, 4), "horizon": 16},
    "rbf": {"centres": (5, 6), "targets": (5, 3), "log_widths": (1, 6)},
    "open_loop": {"controls": (16, 3), "state_size": 6},
}


def example(kind: str) -> policies.Policy:
    arrays = {
        name: shape if isinstance(shape, int) else 0.1 * random.normal(size=shape)
        for name, shape in EXAMPLES[kind].items()
    }
    return policies.from_arrays({"kind": kind, **arrays, "control_limit": LIMIT})


def same(left: policies.Policy, right: policies.Policy) -> bool:
    a, b = left.to_arrays(), right.to_arrays()
    return left.kind == right.kind and all(np.array_equal(a[name], b[name]) for name in {*a, *b})


@pytest.mark.parametrize("kind", EXAMPLES)
def test_every_kind_survives_parameters_and_file_bit_by_bit(tmp_path, kind):
    policy = example(kind)
    parameters = policy_to_parameters(policy, ALL)
    assert set(parameters) <= {*policy_fields(), "policy.kind", "policy.joints"}
    again, joints = policy_from_parameters({**parameters, "horizon": 16})
    assert joints.names == JOINTS
    assert same(again, policy)
    path = tmp_path / "policy_007.yaml"
    write_policy_file(path, policy, ALL)
    from_file, joints = read_policy_file(path)
    assert joints.names == JOINTS
    assert same(from_file, policy)
    state = random.normal(size=6)
    np.testing.assert_array_equal(from_file.act(state, 3), policy.act(state, 3))


def test_widths_of_each_control_are_told_from_shared_ones():
    arrays = example("rbf").to_arrays()
    own = policies.from_arrays({**arrays, "log_widths": 0.1 * random.normal(size=(3, 6))})
    assert same(policy_from_parameters(policy_to_parameters(own, ALL))[0], own)


def test_the_file_holds_what_the_controller_needs_alone(tmp_path):
    path = tmp_path / "policy.yaml"
    settings = {"horizon": 16, "velocity_limit": (1.0, 2.0, 3.0), "start_position": np.arange(3.0)}
    write_policy_file(path, example("linear"), ALL, settings)
    parameters = load_parameters_file(path, "controller")
    assert parameters["horizon"] == 16
    assert parameters["velocity_limit"] == [1.0, 2.0, 3.0]
    assert parameters["start_position"] == [0.0, 1.0, 2.0]
    assert parameters["policy.control_limit"] == LIMIT.tolist()
    document = yaml.safe_load(path.read_text())
    assert document["/**/controller"]["ros__parameters"]["policy"]["kind"] == "linear"
    assert load_parameters_file(path, "learner") == {}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"kind": "magic"}, "'magic' is unknown; valid: linear"),
        ({"kind": ""}, "policy.kind is missing or empty"),
        ({"joints": []}, "policy.joints is missing or empty"),
        ({"joints": ["left", "left", "waist"]}, "names a joint twice"),
        ({"joints": ["left", "right"]}, "expected 8"),
        (
            {"weights": [1.0] * 17},
            r"weights has 17 values; expected 18 \(shape F x D, F = 3, D = 6\)",
        ),
        ({"weights": [1.0] * 15}, "weights has 15 values; expected 18"),
        ({"weights": [1.0] * 17 + [float("nan")]}, "weights of a linear policy holds nan"),
        ({"weights": ["much"] * 18}, "weights holds something else than numbers"),
        ({"bias": [0.0]}, "bias has 1 values; expected 3"),
        ({"control_limit": [1.0, -1.0, 1.0]}, "expected at least 0"),
        ({"magic": [1.0]}, "unknown: magic"),
    ],
)
def test_what_is_wrong_is_named(changes, message):
    parameters = policy_to_parameters(example("linear"), ALL)
    parameters.update({f"policy.{name}": value for name, value in changes.items()})
    with pytest.raises(InvalidSettingError, match=message):
        policy_from_parameters(parameters)


def test_a_missing_field_and_a_missing_file_are_named(tmp_path):
    parameters = policy_to_parameters(example("linear"), ALL)
    del parameters["policy.bias"]
    with pytest.raises(InvalidSettingError, match="missing: bias"):
        policy_from_parameters(parameters)
    with pytest.raises(InvalidSettingError, match=r"none\.yaml"):
        read_policy_file(tmp_path / "none.yaml")
    with pytest.raises(InvalidSettingError, match="does not fit 2 joints"):
        policy_to_parameters(example("linear"), Joints(JOINTS[:2]))


def test_a_policy_of_unactuated_and_continuous_joints_survives(tmp_path):
    joints = Joints(("cart", "pole"), unactuated=("pole",), continuous=("pole",))
    rng = np.random.default_rng(0)
    own = RbfPolicy(
        rng.standard_normal((6, 5)), rng.standard_normal((6, 1)), np.zeros((1, 5)), np.array([10.0])
    )
    parameters = policy_to_parameters(own, joints)
    assert parameters["policy.continuous_joints"] == ["pole"]
    assert same(policy_from_parameters(parameters)[0], own)
    path = tmp_path / "policy.yaml"
    write_policy_file(path, own, joints)
    again, of = read_policy_file(path)
    assert same(again, own)
    assert of == joints
    with pytest.raises(InvalidSettingError, match="expected 2 controls and 4 states"):
        policy_to_parameters(own, Joints(joints.names))
