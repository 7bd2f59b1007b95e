"""The second robot over DDS: recorder, controller and learner as they are, for a cart-pole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from irlpilco_ros.experience.bag_reader import read_bag
from irlpilco_ros.experience.policy_file import policy_to_parameters
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.learning.joints import PolicyOf
from irlpilco_ros.learning.policies import OpenLoopPolicy
from sim_bridge.cart_pole_simulation import CART_POLE_JOINTS, CartPoleSettings, CartPoleSimulation
from sim_bridge.episode import run_trial

pytestmark = [pytest.mark.dds, pytest.mark.slow]

CONFIG = Path(__file__).resolve().parents[1] / "config"
ROBOT = CONFIG / "cart_pole.yaml"
FORCES = 5.0 * np.sin(np.arange(25.0))[:, None]


def check(answer):
    assert answer.success, answer.message
    return answer.message


def start_nodes(ros, folder):
    ros.start(
        "sim_bridge.cart_pole_simulator_node",
        parameters={"lockstep": True, "seed": 3},
        files=[ROBOT],
        wait=False,
    )
    recordings = {"output_directory": str(folder / "recordings")}
    ros.start(
        "irlpilco_ros.nodes.demonstration_recorder",
        parameters=recordings,
        files=[ROBOT],
        wait=False,
    )
    ros.start(
        "irlpilco_ros.nodes.controller",
        parameters={
            **policy_to_parameters(
                OpenLoopPolicy(FORCES, np.array([10.0]), CART_POLE_JOINTS.policy_size),
                CART_POLE_JOINTS,
            ),
        },
        files=[ROBOT],
        wait=False,
    )
    for name in ("cart_pole_simulator", "demonstration_recorder", "controller"):
        ros.wait_for_node(name)


def test_the_nodes_of_the_sweep_serve_a_cart_pole(ros, tmp_path):
    start_nodes(ros, tmp_path)
    # A demonstration: somebody pushes the cart by a table of forces.
    check(ros.trigger("cart_pole_simulator/reset", 20.0))
    check(ros.trigger("demonstration_recorder/start", 20.0))
    check(ros.trigger("controller/run_trial", 60.0))
    answer = check(ros.trigger("demonstration_recorder/stop", 20.0))
    demonstration = Path(answer.partition("bag: ")[2])
    rollout = read_bag(demonstration).rollout(CART_POLE_JOINTS, 25)
    np.testing.assert_array_equal(rollout.controls, FORCES)
    check_same_as_in_process(rollout)

    ros.start(
        "irlpilco_ros.nodes.learner",
        parameters={
            "run_directory": str(tmp_path / "run"),
            "demonstration": str(demonstration),
            "evaluations": 5,
            "screening_evaluations": 0,
        },
        files=[ROBOT, CONFIG / "swing_up.yaml"],
        wait=False,
    )
    ros.wait_for_node("learner")
    assert check(ros.trigger("learn_iteration", 120.0)).startswith("iteration 1: trial 001")
    check_run(RunDirectory(tmp_path / "run"))


def check_same_as_in_process(rollout):
    """Over DDS in lockstep a trial is that of one process, bit for bit."""
    simulation = CartPoleSimulation(CartPoleSettings(seed=3))
    simulation.reset()
    policy = OpenLoopPolicy(FORCES, np.array([10.0]), CART_POLE_JOINTS.policy_size)
    expected = run_trial(simulation, PolicyOf(CART_POLE_JOINTS, policy), 25, 0.1)
    np.testing.assert_array_equal(rollout.states, expected.states)


def check_run(run):
    rows = run.metrics()
    assert [row.iteration for row in rows] == [0, 1]
    trials = run.search_trials(CART_POLE_JOINTS, lambda _: 25).trials
    assert set(trials) == {0, 1}  # found again by their commands, angles and all
    iteration = run.read_iteration(1)
    assert iteration.policy.kind == "rbf"
    assert iteration.policy.state_size == CART_POLE_JOINTS.policy_size
    assert iteration.weights.shape == (3,)
    starts = np.array([trials[k].rollout.states[0] for k in (0, 1)])
    assert np.abs(starts).max() < 0.5
    assert not np.allclose(starts[0], starts[1], atol=0.02)  # every reset begins elsewhere
