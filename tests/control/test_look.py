"""Looks: noise averaged out, and no look at what has not settled."""

from __future__ import annotations

import numpy as np
import pytest

from irlpilco_ros.control.look import LookTaker


def look_at(motion, noise=4e-4, seconds=6.0):
    """Show positions over time until there is a look; return it and when it came."""
    random = np.random.default_rng(0)
    taker = LookTaker()
    for step in range(round(seconds / 0.01)):
        time = 0.01 * step
        seen = np.array(motion(time)) + noise * random.standard_normal(2)
        look = taker.take(time, seen)
        if look is not None:
            return look, time
    raise AssertionError("no look")


def test_a_look_at_a_robot_that_slides_says_where_it_was_and_how_fast():
    look, when = look_at(lambda time: (1.0 + 0.05 * time, -1.0))
    assert when == pytest.approx(0.3)
    assert look.time == pytest.approx(0.15)
    np.testing.assert_allclose(look.position, [1.0075, -1.0], atol=4.0 * look.position_error.max())
    np.testing.assert_allclose(look.speed, [0.05, 0.0], atol=0.004)
    assert (look.position_error < 2e-4).all()
    assert (look.speed_error < 0.03).all()


def test_a_robot_that_has_not_settled_is_watched_on():
    look, when = look_at(lambda time: (0.1 * np.exp(-time / 0.3), 0.0))
    assert when > 0.6
    assert abs(look.speed[0]) < 0.05


def test_a_robot_that_never_settles_is_looked_at_all_the_same():
    look, when = look_at(lambda time: (0.5 * time**2, 0.0))
    assert 3.0 < when < 3.1
    assert look.speed_error[0] > 0.2, "what has not settled is no certainty"
