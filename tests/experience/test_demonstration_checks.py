"""What keeps a recording from being imitated, and that nothing else does."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
from example_recordings import ROBOT, moving, write_as

from irlpilco_ros.experience.demonstration_checks import checked_motions
from irlpilco_ros.experience.demonstrations import checked_demonstrations
from irlpilco_ros.experience.errors import BagError, UnfitDemonstrationError

RATES = [2.0, 20.0, 100.0]


def refusal(recorded, robot=ROBOT, window=()):
    with pytest.raises(UnfitDemonstrationError) as refused:
        checked_motions([recorded], robot, window)
    return str(refused.value)


def changed(recorded, sample, positions):
    places = recorded.positions.copy()
    places[sample] = positions
    return dataclasses.replace(recorded, positions=places)


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("seed", range(5))
def test_noise_and_jitter_are_no_fault(rate, seed):
    recorded = moving(rate=rate, before=1.0, after=1.0)
    rng = np.random.default_rng(seed)
    noisy = dataclasses.replace(
        recorded,
        stamps=recorded.stamps + rng.uniform(-0.2, 0.2, len(recorded)) / rate,
        positions=recorded.positions + 1e-3 * rng.standard_normal(recorded.positions.shape),
        velocities=recorded.velocities + 1e-2 * rng.standard_normal(recorded.positions.shape),
    )
    (shown,) = checked_motions([noisy], ROBOT)
    assert shown.rollout.steps in (16, 17)


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("part", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("told", [True, False])
def test_a_zero_reading_is_refused_wherever_it_is(rate, part, told):
    recorded = moving(rate=rate)
    if not told:
        recorded = dataclasses.replace(
            recorded, velocities=np.full_like(recorded.velocities, np.nan)
        )
    said = refusal(changed(recorded, round(part * (len(recorded) - 1)), 0.0))
    assert "all joints read zero there, as of a sensor that gives no reading" in said


def test_a_robot_may_stand_at_zero():
    recorded = moving(rate=20.0, offset=(-0.3, -0.6))
    assert not recorded.positions[0].any()
    checked_motions([recorded], ROBOT)


@pytest.mark.parametrize("rate", RATES)
def test_positions_outside_the_limits_are_refused(rate):
    robot = dataclasses.replace(ROBOT, position_upper=(1.05, 2.0))
    said = refusal(moving(rate=rate), robot)
    assert re.search(
        r"shoulder is at 1\.1000 rad after 8\.00 s, outside its limits \[-2, 1.05\]", said
    )
    assert "degrees" not in said


def test_degrees_are_guessed():
    recorded = moving(rate=20.0)
    degrees = dataclasses.replace(
        recorded,
        positions=np.rad2deg(recorded.positions),
        velocities=np.rad2deg(recorded.velocities),
    )
    assert "as if the positions were in degrees, and radians are expected" in refusal(degrees)


@pytest.mark.parametrize("rate", RATES)
def test_a_motion_that_is_too_fast_for_the_robot_is_refused(rate):
    said = refusal(moving(rate=rate, duration=0.8, after=2.0))
    assert re.search(r"shoulder goes from .* in .* rad/s, where its limit is 1$", said)


@pytest.mark.parametrize("rate", RATES)
def test_steps_that_the_recorded_speeds_do_not_make_are_refused(rate):
    recorded = moving(rate=rate)
    wrong = dataclasses.replace(recorded, velocities=np.full_like(recorded.velocities, 0.9))
    assert "where its recorded speeds make" in refusal(wrong)


@pytest.mark.parametrize("rate", RATES)
def test_a_wrap_is_named_and_is_none_for_a_joint_that_turns_without_end(rate):
    recorded = moving(rate=rate, offset=(np.pi - 0.7, 0.0))
    wrapped = dataclasses.replace(recorded, positions=np.angle(np.exp(1j * recorded.positions)))
    wide = dataclasses.replace(ROBOT, position_lower=(-4.0, -2.0), position_upper=(4.0, 2.0))
    said = refusal(wrapped, wide)
    assert "that is a whole turn: name the joint in continuous_joints" in said
    turning = dataclasses.replace(ROBOT, continuous_joints=("shoulder",))
    (shown,) = checked_motions([wrapped], turning)
    assert np.abs(np.diff(shown.rollout.states[:, 0])).max() < 0.1


@pytest.mark.parametrize("rate", [0.9, 1.5])
def test_a_recording_too_coarse_for_the_control_period_is_refused(rate):
    said = refusal(moving(rate=rate))
    assert f"a sample every {1 / rate:.3f} s, too few for the control_period of 0.5 s" in said
    assert "record it at 2 Hz or more" in said


@pytest.mark.parametrize("rate", RATES)
def test_a_hole_is_refused_and_a_sample_that_is_lost_at_a_high_rate_is_not(rate):
    recorded = moving(rate=rate)

    def without(begin, end):
        times = recorded.stamps - recorded.stamps[0]
        keep = (times < begin) | (times > end)
        names = ("stamps", "positions", "velocities", "commands")
        return dataclasses.replace(recorded, **{n: getattr(recorded, n)[keep] for n in names})

    said = refusal(without(3.9, 5.1))
    assert "after the first one; expected one at least every control_period, 0.5 s" in said
    if rate > 2.0:
        (shown,) = checked_motions([without(3.01, 3.2)], ROBOT)
        (whole,) = checked_motions([recorded], ROBOT)
        np.testing.assert_allclose(shown.rollout.states, whole.rollout.states, atol=5e-3)


def test_what_lies_outside_of_a_window_is_not_checked():
    recorded = changed(moving(rate=20.0), 3, 0.0)
    refusal(recorded)
    (shown,) = checked_motions([recorded], ROBOT, (1.0, 8.0))
    assert shown.rollout.steps == 14
    assert "all joints read zero" in refusal(recorded, window=(0.0, 8.0))


def test_a_refusal_names_the_bag_and_of_several_which(tmp_path):
    for number, bad in enumerate([False, True]):
        recorded = moving(rate=20.0)
        write_as(changed(recorded, 9, 0.0) if bad else recorded, tmp_path / f"{number:03d}")
    with pytest.raises(BagError) as refused:
        checked_demonstrations(tmp_path, ROBOT)
    said = str(refused.value)
    assert said.startswith(f"the demonstration {tmp_path} is refused: number 2 of 2: ")
