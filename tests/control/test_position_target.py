"""Positions that follow from commanded velocities."""

import numpy as np

from irlpilco_ros.control.motions import Command
from irlpilco_ros.control.position_target import PositionTarget

MEASURED = np.array([1.0, -1.0])


def command(stamp_ms, *values, **options):
    return Command(stamp_ms * 1_000_000, np.array(values, dtype=float), **options)


def test_it_begins_where_the_robot_is_and_goes_by_the_velocities_alone():
    target = PositionTarget()
    np.testing.assert_array_equal(target.follow(command(10, 0.5, -1.0), MEASURED), MEASURED)
    lagging = MEASURED - 0.3
    found = target.follow(command(30, 1.0, 0.0), lagging)
    np.testing.assert_allclose(found, [1.01, -1.02], rtol=1e-12)
    np.testing.assert_allclose(target.follow(command(130, 0.0, 0.0), lagging), [1.11, -1.02])


def test_the_same_command_again_changes_nothing():
    target = PositionTarget()
    target.follow(command(0, 1.0, 1.0), MEASURED)
    again = command(100, 1.0, 1.0)
    first = target.follow(again, MEASURED)
    np.testing.assert_array_equal(target.follow(again, MEASURED), first)


def test_a_motion_ends_at_its_target_and_the_next_begins_where_the_robot_is():
    target = PositionTarget()
    target.follow(command(0, 1.0, 0.0), MEASURED)
    end = target.follow(command(100, 0.0, 0.0, done=True), MEASURED)
    np.testing.assert_allclose(end, [1.1, -1.0])
    np.testing.assert_array_equal(target.follow(command(200, 1.0, 0.0), MEASURED), MEASURED)


def test_a_robot_that_is_stopped_is_pushed_no_further():
    target = PositionTarget()
    target.follow(command(0, 1.0, 0.0), MEASURED)
    stopped = target.follow(command(500, 0.0, 0.0, done=True, halts=True), MEASURED)
    np.testing.assert_array_equal(stopped, MEASURED)
