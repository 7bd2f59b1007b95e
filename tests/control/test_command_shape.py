"""Between the decisions of a policy: continuous, and of the mean that was decided."""

import numpy as np
import pytest

from irlpilco_ros.control.command_shape import CommandShape
from irlpilco_ros.learning.policies import LinearPolicy, SmoothPhasePolicy

F, H = 2, 6
FINE = (np.arange(2000) + 0.5) / 2000


def policy(blend):
    rng = np.random.default_rng(0)
    bumps = 0.1 * rng.standard_normal((F, 5))
    return SmoothPhasePolicy(
        np.zeros((F, 4)), bumps, H, np.array([4.0, 8.0]), np.zeros((1, 4)), blend
    )


@pytest.mark.parametrize("blend", [0.0, 0.5, 1.0])
def test_the_mean_of_each_period_is_what_was_decided(blend):
    shape, rng = CommandShape(policy(blend)), np.random.default_rng(1)
    for _ in range(H):
        decided = 0.3 * rng.standard_normal(F)
        shape.decide(decided)
        mean = np.mean([shape.at(time) for time in FINE], axis=0)
        np.testing.assert_allclose(mean, decided, atol=2e-4)


def test_commands_begin_at_rest_and_never_jump():
    shape, rng = CommandShape(policy(0.5)), np.random.default_rng(2)
    last = np.zeros(F)
    for _ in range(H):
        shape.decide(0.3 * rng.standard_normal(F))
        np.testing.assert_allclose(shape.at(0.0), last, atol=1e-9)
        last = shape.at(1.0)
        steps = np.diff([shape.at(time) for time in np.linspace(0.0, 1.0, 1001)], axis=0)
        assert np.abs(steps).max() < 6e-3


def test_a_policy_without_feed_forward_holds_its_decisions():
    shape = CommandShape(LinearPolicy(np.zeros((F, 4)), np.zeros(F), np.ones(F)))
    for decided in (np.array([0.3, -0.1]), np.array([-0.2, 0.4])):
        shape.decide(decided)
        for time in (0.0, 0.4, 1.0):
            np.testing.assert_allclose(shape.at(time), decided, atol=1e-12)


def test_a_policy_that_follows_its_feed_forward_alone_sends_just_that():
    """At a tick it decides the period's mean, so that there is nothing to blend in."""
    still = policy(0.5)
    shape = CommandShape(still)
    for tick in range(H):
        shape.decide(np.mean([still.between(tick + time) for time in FINE], axis=0))
    np.testing.assert_allclose(shape.at(0.7), still.between(H - 1 + 0.7), atol=2e-3)
