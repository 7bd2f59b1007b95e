"""`ros2 param dump` and `load` on every node: the same calls that the verbs make, over DDS."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from controlled_robot import CONTROLLER, JOINTS, LONG, MOVING
from rclpy.parameter import parameter_dict_from_yaml_file, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.task import Future

from irlpilco_ros.experience.policy_file import policy_to_parameters
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.policies import (
    LinearPhasePolicy,
    LinearPolicy,
    OpenLoopPolicy,
    Policy,
    RbfPolicy,
)

pytestmark = pytest.mark.dds

NODES = {
    "controller": CONTROLLER,
    "demonstration_recorder": "irlpilco_ros.nodes.demonstration_recorder",
    "learner": "irlpilco_ros.nodes.learner",
    "baxter_simulator": "sim_bridge.baxter_simulator_node",
    "cart_pole_simulator": "sim_bridge.cart_pole_simulator_node",
    "demonstrator": "sim_bridge.demonstrator_node",
}


def dump(ros, name: str) -> dict[str, Any]:
    """Return what `ros2 param dump` writes."""
    client = AsyncParameterClient(ros.node, name)
    ros.wait_for(client.services_are_ready, f"the parameters of {name}")
    names = sorted(answer_of(ros, client.list_parameters, f"names of {name}").result.names)
    got = answer_of(ros, lambda: client.get_parameters(names), f"values of {name}")
    values = [parameter_value_to_python(each) for each in got.values]
    return dict(zip(names, values, strict=True))


def answer_of(ros, ask: Callable[[], Future], what: str) -> Any:
    """Ask until there is an answer: a node that is new may not know yet whom to give it."""
    for _ in range(12):
        asked = ask()
        with contextlib.suppress(AssertionError):
            ros.wait_for(asked.done, what, 5.0)
            return asked.result()
    pytest.fail(f"asked twelve times in vain for {what}")


def write(path: Path, name: str, values: dict[str, Any]) -> Path:
    """Write values as `ros2 param dump` does, by nested keys in the order of the alphabet."""
    tree: dict[str, Any] = {}
    for key, value in values.items():
        *groups, last = key.split(".")
        node = tree
        for group in groups:
            node = node.setdefault(group, {})
        node[last] = value
    path.write_text(yaml.dump({f"/{name}": {"ros__parameters": tree}}, default_flow_style=False))
    return path


def load(ros, name: str, path: Path) -> list[Any]:
    """Do what `ros2 param load` does; return the results of the single parameters."""
    client = AsyncParameterClient(ros.node, name)
    ros.wait_for(client.services_are_ready, f"the parameters of {name}")
    answer = client.load_parameter_file(str(path), use_wildcard=True)
    ros.wait_for(answer.done, f"an answer of {name}")
    return list(answer.result().results)


@pytest.mark.parametrize(
    ("name", "robot"),
    [(name, "config/baxter.yaml") for name in NODES] + [("controller", "config/panda.yaml")],
)
def test_what_is_dumped_can_be_loaded_and_started_with(ros, tmp_path, name, robot):
    first = ros.start(
        NODES[name], files=[robot], parameters={"run_directory": str(tmp_path / "run")}
    )
    before = dump(ros, name)
    assert before
    assert None not in before.values()
    path = write(tmp_path / "dump.yaml", name, before)
    assert [result.reason for result in load(ros, name, path) if not result.successful] == []
    assert dump(ros, name) == before
    assert first.stop() == 0
    ros.wait_until_gone(name)
    ros.start(NODES[name], files=[path])
    assert dump(ros, name) == before


def test_a_learner_that_has_a_run_takes_its_own_dump(ros, tmp_path):
    """The demonstration is set anew by it, to what it is."""
    run, shown = str(tmp_path / "run"), str(Path("bags/sweep/demonstration").absolute())
    ros.start(
        NODES["learner"],
        files=["config/baxter.yaml", "config/sweep.yaml"],
        parameters={"run_directory": run, "demonstration": shown},
    )
    before = dump(ros, "learner")
    assert (before["run_directory"], before["demonstration"]) == (run, shown)
    path = write(tmp_path / "dump.yaml", "learner", before)
    assert [result.reason for result in load(ros, "learner", path) if not result.successful] == []
    assert dump(ros, "learner") == before


# Numbers that YAML, ROS and Python write in ways of their own. Smaller ones ROS does not read.
AWKWARD = np.array([1e-05, 0.1 + 0.2, 2.3e-308, 1e22, -0.0, 1 / 3, 2e-16, 1.0])


def policies() -> list[Policy]:
    """Return one policy of each kind for two joints."""
    few, limit = AWKWARD[:3], np.array([1e-05, 2.0])
    return [
        LinearPolicy(np.tile(few[:2], (2, 2)), few[:2], limit),
        LinearPhasePolicy(np.tile(few[:2], (2, 2)), np.tile(few, (2, 1)), 7, limit),
        RbfPolicy(np.ones((3, 4)) / 3, np.tile(few[:2], (3, 1)), np.full((1, 4), -2e-05), limit),
        OpenLoopPolicy(np.array([[1e-05, 2e-05], [0.0, -1 / 3e5]]), limit, 4),
    ]


def as_parameters(policy: Policy) -> dict[str, Any]:
    return policy_to_parameters(policy, Joints(tuple(JOINTS)))


def test_a_policy_of_any_kind_is_loaded_bit_by_bit_over_any_other(ros, tmp_path):
    """Also a start that it is tried at, and numbers with exponents."""
    controller = ros.start(CONTROLLER, parameters=LONG)
    dumps = []
    for policy in policies():
        given = {**as_parameters(policy), "start_position": [1e-05, 0.1 + 0.2]}
        assert ros.set_parameters("controller", given).successful
        values = dump(ros, "controller")
        for name, value in given.items():
            assert values[name] == value, name
        dumps.append(values)
    paths = [write(tmp_path / f"{i}.yaml", "controller", values) for i, values in enumerate(dumps)]
    for i in (0, 1, 2, 3, 2, 1, 0, 3, 1, 3, 0, 2, 0):
        assert all(result.successful for result in load(ros, "controller", paths[i]))
        assert dump(ros, "controller") == dumps[i]
    assert controller.stop() == 0
    for path, values in zip(paths, dumps, strict=True):
        ros.wait_until_gone("controller")
        again = ros.start(CONTROLLER, files=[path])
        assert dump(ros, "controller") == values
        assert again.stop() == 0


def test_a_policy_that_is_wrong_in_one_place_is_not_loaded_at_all(ros, tmp_path):
    ros.start(CONTROLLER, parameters={**LONG, **MOVING})
    before = dump(ros, "controller")
    good = {**as_parameters(policies()[0]), "start_position": [0.1, 0.1], "approach_speed": 0.3}
    for name, wrong, reason in (
        ("policy.weights", [1.0, 2.0], "2 values"),
        ("policy.bias", [1.0, float("nan")], "expected finite numbers"),
        ("policy.control_limit", [9.0, 1.0], "at most the robot's limit"),
        ("start_position", [5.0, 0.0], "inside its limits"),
        ("policy.bias", None, "missing: bias"),
        ("policy.kind", None, "unknown: "),
    ):
        values = {key: value for key, value in {**good, name: wrong}.items() if value is not None}
        path = write(tmp_path / "wrong.yaml", "controller", values)
        results = dict(zip(names_in(path), load(ros, "controller", path), strict=True))
        assert results.pop("approach_speed").successful
        assert not any(result.successful for result in results.values())
        assert all(reason in result.reason for result in results.values()), name
        assert dump(ros, "controller") == {**before, "approach_speed": 0.3}


def test_what_a_controller_without_a_policy_dumps_takes_a_policy_away(ros, tmp_path):
    ros.start(CONTROLLER, parameters=LONG)
    path = write(tmp_path / "none.yaml", "controller", dump(ros, "controller"))
    assert ros.set_parameters("controller", MOVING).successful
    assert all(result.successful for result in load(ros, "controller", path))
    assert "there is no policy" in ros.trigger("controller/run_trial").message


def names_in(path: Path) -> list[str]:
    """Return the names of a file's parameters in the order in which the verb sends them."""
    return list(parameter_dict_from_yaml_file(str(path), use_wildcard=True))
