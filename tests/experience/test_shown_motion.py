"""From a recording to what is imitated: length, ticks, speeds, turns."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from example_recordings import JOINTS, ROBOT, moving, read_as, way

from irlpilco_ros.experience.demonstration_checks import wanted_by
from irlpilco_ros.experience.errors import UnfitDemonstrationError
from irlpilco_ros.experience.shown_motion import shown_motion, shown_motions
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.learning.joints import Joints

WANTED = wanted_by(ROBOT)


@pytest.mark.parametrize("rate", [2.0, 4.0, 20.0, 100.0, 333.0])
def test_the_rate_of_a_recording_is_no_time(rate):
    shown = shown_motion(moving(rate=rate), WANTED)
    assert shown.rollout.steps == 16
    assert not shown.rollout.commanded
    positions, velocities = way(0.5 * np.arange(17))
    np.testing.assert_allclose(shown.rollout.states[:, :2], positions, atol=2e-3)
    # It sets off and ends within a few milliseconds, where a dense recording is smoothed.
    np.testing.assert_allclose(shown.rollout.states[1:-1, 2:], velocities[1:-1], atol=2e-2)
    np.testing.assert_allclose(shown.rollout.states[[0, -1], 2:], velocities[[0, -1]], atol=5e-2)


def test_samples_on_the_ticks_stay_as_they_are():
    recorded = moving(rate=2.0)
    states = np.hstack([recorded.positions, recorded.velocities])
    np.testing.assert_array_equal(shown_motion(recorded, WANTED).rollout.states, states)
    dense = moving(rate=20.0)
    states = np.hstack([dense.positions, dense.velocities])[::10]
    np.testing.assert_array_equal(shown_motion(dense, WANTED).rollout.states, states)


@pytest.mark.parametrize("rate", [2.0, 20.0, 100.0])
@pytest.mark.parametrize(("before", "after"), [(1.9, 1.3), (0.0, 5.0), (3.0, 0.0), (2.25, 2.0)])
def test_what_stands_before_and_after_is_left_out(rate, before, after):
    recorded = moving(rate=rate, before=before, after=after)
    shown = shown_motion(recorded, WANTED)
    assert shown.rollout.steps in (16, 17)
    assert abs(shown.begin - before) < 0.6
    np.testing.assert_allclose(shown.rollout.states[0, :2], recorded.positions[0], atol=5e-3)
    np.testing.assert_allclose(shown.rollout.states[-1, :2], recorded.positions[-1], atol=5e-3)
    whole = dataclasses.replace(WANTED, motion=dataclasses.replace(ROBOT, cut_to_motion=False))
    steps = round(2.0 * (recorded.stamps[-1] - recorded.stamps[0]) - 0.45)
    assert shown_motion(recorded, whole).rollout.steps == steps


@pytest.mark.parametrize(
    ("horizon", "after", "steps"), [(16, 0.0, 16), (15, 0.0, 15), (17, 0.0, 17), (24, 4.0, 24)]
)
def test_a_horizon_that_fits_is_kept(horizon, after, steps):
    wanted = dataclasses.replace(WANTED, horizon=horizon)
    shown = shown_motion(moving(rate=20.0, after=after), wanted)
    assert shown.rollout.steps == steps
    assert bool(shown.notes) == (horizon == 15)  # half a second is left out, and that is said
    if horizon > 16:  # it stands at the end
        np.testing.assert_allclose(
            shown.rollout.states[16:, :2],
            way(np.array([8.0]))[0].repeat(horizon - 15, axis=0),
            atol=2e-3,
        )


def test_a_long_horizon_may_begin_before_the_motion():
    wanted = dataclasses.replace(WANTED, horizon=22)
    shown = shown_motion(moving(rate=20.0, before=3.0), wanted)
    assert shown.rollout.steps == 22
    assert shown.begin == pytest.approx(0.0)


@pytest.mark.parametrize("horizon", [8, 14, 18, 32])
def test_a_horizon_that_does_not_fit_is_refused(horizon):
    wanted = dataclasses.replace(WANTED, horizon=horizon)
    with pytest.raises(UnfitDemonstrationError) as refused:
        shown_motion(moving(rate=20.0), wanted)
    assert f"the horizon of {horizon} decisions takes {0.5 * horizon:g} s" in str(refused.value)
    assert "s of motion, from 0." in str(refused.value)
    assert "set horizon to 0 or 16" in str(refused.value)


def test_a_window_is_taken_as_it_is_named():
    recorded = moving(rate=20.0, before=2.0, after=1.0)
    shown = shown_motion(recorded, dataclasses.replace(WANTED, window=(4.0, 7.2)))
    assert shown.rollout.steps == 6
    assert (shown.begin, shown.motion) == (4.0, None)
    assert "its last 0.20 s, less than a control_period, are left out" in shown.notes
    np.testing.assert_allclose(
        shown.rollout.states[:, :2], way(2.0 + 0.5 * np.arange(7))[0], atol=1e-3
    )
    with pytest.raises(UnfitDemonstrationError, match=r"takes 8 s, but it shows 3.2 s to imitate"):
        shown_motion(recorded, dataclasses.replace(WANTED, window=(4.0, 7.2), horizon=16))


@pytest.mark.parametrize("window", [(1.0,), (3.0, 2.0), (-1.0, 4.0), (0.0, 99.0), (0.0, 0.2)])
def test_a_window_that_is_none_is_refused(window):
    with pytest.raises(UnfitDemonstrationError, match=r"demonstration_window|shorter than a cont"):
        shown_motion(moving(rate=20.0), dataclasses.replace(WANTED, window=window))


@pytest.mark.parametrize("kind", ["nan", "short", "zeros", "one joint"])
def test_speeds_that_are_not_published_are_computed_and_told(tmp_path, kind):
    recorded = moving(rate=20.0)
    velocities = recorded.velocities.copy()
    velocities[:, 1 if kind == "one joint" else slice(None)] = 0.0 if kind == "zeros" else np.nan
    recorded = dataclasses.replace(recorded, velocities=velocities)
    if kind == "short":
        recorded = read_as(recorded, tmp_path, velocities=1)
        assert np.isnan(recorded.velocities).all()
    shown = shown_motion(recorded, WANTED)
    whose = " of elbow" if kind == "one joint" else ""
    assert shown.notes == (
        f"velocities{whose} that were not recorded are computed from the positions",
    )
    speeds = way(0.5 * np.arange(17))[1]  # at both ends from one side
    np.testing.assert_allclose(shown.rollout.states[1:-1, 2:], speeds[1:-1], atol=0.01)
    assert shown_motion(moving(rate=20.0), WANTED).notes == ()


@pytest.mark.parametrize("rate", [2.0, 50.0])
def test_a_joint_that_turns_without_end_does_not_wrap(rate):
    plain = moving(rate=rate, offset=(np.pi - 0.7, 0.0))
    seen = np.angle(np.exp(1j * plain.positions))
    assert np.abs(np.diff(seen[:, 0])).max() > 3.0
    turning = dataclasses.replace(WANTED, joints=Joints(JOINTS, continuous=JOINTS[:1]))
    shown = shown_motion(dataclasses.replace(plain, positions=seen), turning)
    expected = shown_motion(plain, WANTED)
    np.testing.assert_allclose(shown.rollout.states, expected.rollout.states, atol=1e-9)
    assert shown.motion == expected.motion


def test_demonstrations_of_a_turning_joint_are_brought_to_one_turn():
    joints = Joints(JOINTS, continuous=JOINTS[:1])
    turning = dataclasses.replace(WANTED, joints=joints)
    first = moving(rate=20.0, offset=(np.pi - 1e-3, 0.0))
    second = moving(rate=20.0, offset=(-np.pi + 1e-3, 0.0))
    both = shown_motions([first, second], turning)
    np.testing.assert_allclose(both[0].rollout.states, both[1].rollout.states, atol=3e-3)


def test_several_demonstrations_get_one_length():
    short, long = moving(rate=20.0, duration=8.0), moving(rate=20.0, duration=8.3, after=1.0)
    assert [each.rollout.steps for each in shown_motions([short, long], WANTED)] == [17, 17]
    with pytest.raises(UnfitDemonstrationError, match="take 16, 24 control periods; show the task"):
        shown_motions([short, moving(rate=20.0, duration=12.0)], WANTED)


def test_a_trial_at_the_control_period_is_taken_as_it_is():
    recorded = moving(rate=2.0, before=1.0)
    commands = np.full_like(recorded.positions, 0.1)
    commands[-1] = 0.0
    trial = dataclasses.replace(recorded, commands=commands)
    shown = shown_motion(trial, WANTED)
    assert shown.rollout.commanded
    assert shown.rollout.steps == len(recorded) - 1


def test_commands_at_another_pace_are_no_decisions():
    recorded = moving(rate=20.0)
    commands = np.full_like(recorded.positions, 0.1)
    shown = shown_motion(dataclasses.replace(recorded, commands=commands), WANTED)
    assert not shown.rollout.commanded
    assert shown.rollout.steps == 16
    assert "its commands are not one per control_period, and are left out" in shown.notes


def test_nothing_to_imitate_is_refused():
    still = moving(rate=20.0, duration=8.0, size=0.0)
    with pytest.raises(UnfitDemonstrationError, match=r"nothing moves in its 8.0 s: no joint"):
        shown_motion(still, WANTED)
    one = Trajectory(
        JOINTS, np.zeros(1), np.zeros((1, 2)), np.zeros((1, 2)), np.full((1, 2), np.nan)
    )
    with pytest.raises(UnfitDemonstrationError, match="1 samples tell of shoulder, elbow"):
        shown_motion(one, WANTED)
