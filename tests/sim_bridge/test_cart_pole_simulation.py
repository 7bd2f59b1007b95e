"""The simulated cart-pole: starts, commands, noise and trials."""

import numpy as np
import pytest

from irlpilco_ros.learning.joints import PolicyOf
from irlpilco_ros.learning.policies import OpenLoopPolicy
from sim_bridge.cart_pole_equations import CartPoleParameters, integrate
from sim_bridge.cart_pole_simulation import (
    CART_POLE_JOINTS,
    CartPoleSettings,
    CartPoleSimulation,
)
from sim_bridge.episode import run_trial
from sim_bridge.errors import InvalidCommandError

QUIET = CartPoleSettings(position_noise=0.0, velocity_noise=0.0)


def test_it_is_held_until_the_first_command():
    simulation = CartPoleSimulation(QUIET)
    start = simulation.true_state
    for _ in range(50):
        simulation.step()
    np.testing.assert_array_equal(simulation.true_state, start)
    assert simulation.time == pytest.approx(0.5)
    simulation.command(["cart"], [10.0])
    simulation.step()
    expected = integrate(start, 10.0, 0.01, CartPoleParameters())
    np.testing.assert_allclose(simulation.true_state, expected, atol=1e-12)


def test_every_reset_begins_elsewhere_and_the_same_seed_repeats():
    simulation = CartPoleSimulation(QUIET)
    starts = [simulation.true_state]
    for _ in range(200):
        simulation.reset()
        starts.append(simulation.true_state)
    spread = np.std(starts, axis=0)
    np.testing.assert_allclose(spread, 0.1, rtol=0.2)
    again = CartPoleSimulation(QUIET)
    again.reset()
    np.testing.assert_array_equal(again.true_state, starts[1])


def test_a_force_ends_after_a_while_and_is_limited():
    simulation = CartPoleSimulation(QUIET)
    simulation.command(["cart"], [1000.0])
    assert simulation.read().efforts[0] == 0.0
    expected = simulation.true_state
    for period in range(40):
        simulation.step()
        force = 10.0 if period < 20 else 0.0
        expected = integrate(expected, force, 0.01, CartPoleParameters())
    np.testing.assert_allclose(simulation.true_state, expected, atol=1e-12)


def test_measurements_are_noisy():
    simulation = CartPoleSimulation(CartPoleSettings(start_spread=0.0))
    readings = []
    for _ in range(500):
        simulation.step()
        readings.append(simulation.read().state(("cart", "pole")))
    np.testing.assert_allclose(np.std(readings, axis=0), 0.01, rtol=0.2)
    assert simulation.read() is simulation.read()


@pytest.mark.parametrize(
    ("names", "efforts", "message"),
    [
        (["pole"], [1.0], "expected one, for the joint cart"),
        (["cart", "pole"], [1.0, 0.0], "expected one"),
        (["cart"], [], "0 efforts"),
        (["cart"], [float("nan")], "not finite"),
    ],
)
def test_senseless_commands_are_refused(names, efforts, message):
    simulation = CartPoleSimulation(QUIET)
    with pytest.raises(InvalidCommandError, match=message):
        simulation.command(names, efforts)


def test_a_trial_holds_each_force_for_a_control_period():
    simulation = CartPoleSimulation(QUIET)
    forces = np.array([[3.0], [-8.0], [0.5]])
    policy = OpenLoopPolicy(forces, np.array([10.0]), CART_POLE_JOINTS.policy_size)
    rollout = run_trial(simulation, PolicyOf(CART_POLE_JOINTS, policy), 3, 0.1)
    np.testing.assert_array_equal(rollout.controls, forces)
    state = rollout.states[0]
    for force, following in zip(forces[:, 0], rollout.states[1:], strict=True):
        state = integrate(state, force, 0.1, CartPoleParameters())
        np.testing.assert_allclose(following, state, atol=1e-9)
