from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from example_trajectories import JOINTS, demonstration, trial

from irlpilco_ros.experience.errors import BagError, IncompleteTrialError
from irlpilco_ros.experience.trajectory import Trajectory, missing_in
from irlpilco_ros.learning.joints import Joints


def cut(trajectory: Trajectory, keep) -> Trajectory:
    return Trajectory(
        trajectory.joint_names,
        *(getattr(trajectory, n)[keep] for n in ("stamps", "positions", "velocities", "commands")),
    )


def test_a_trial_gives_every_state_with_its_control_and_the_last_state():
    whole = trial(steps=16)
    rollout = whole.rollout(Joints(JOINTS), 16)
    np.testing.assert_array_equal(rollout.states, np.hstack([whole.positions, whole.velocities]))
    np.testing.assert_array_equal(rollout.controls, whole.commands[:16])


def test_joints_come_in_the_order_that_is_asked_for():
    whole = trial()
    rollout = whole.rollout(Joints(("wrist", "shoulder")), 16)
    np.testing.assert_array_equal(rollout.states[:, :2], whole.positions[:, [2, 0]])
    np.testing.assert_array_equal(rollout.states[:, 2:], whole.velocities[:, [2, 0]])
    np.testing.assert_array_equal(rollout.controls, whole.commands[:16, [2, 0]])


def test_samples_without_commands_around_and_within_a_trial_are_left_out():
    whole = trial(steps=4)
    stamps = np.array([999.2, 999.7, *whole.stamps, 1002.5])
    rows = [0, 0, *range(5), 0]
    commands = whole.commands[rows].copy()
    commands[[0, 1, -1]] = np.nan
    framed = Trajectory(JOINTS, stamps, whole.positions[rows], whole.velocities[rows], commands)
    np.testing.assert_array_equal(
        framed.rollout(Joints(JOINTS), 4).states, whole.rollout(Joints(JOINTS)).states
    )


def test_a_demonstration_has_no_controls_and_is_cut_to_the_horizon():
    shown = demonstration(steps=20)
    rollout = shown.rollout(Joints(JOINTS), 16)
    assert not rollout.commanded
    np.testing.assert_array_equal(rollout.states[:, :3], shown.positions[:17])
    assert shown.rollout(Joints(JOINTS)).steps == 20
    with pytest.raises(IncompleteTrialError, match="21 samples; expected at least 31"):
        shown.rollout(Joints(JOINTS), 30)


def test_a_trial_without_its_zero_command_broke_off():
    with pytest.raises(IncompleteTrialError, match="broke off after 10 of 16 commands"):
        cut(trial(), slice(10)).rollout(Joints(JOINTS), 16)


def test_a_trial_that_was_stopped_early_is_incomplete():
    with pytest.raises(IncompleteTrialError, match="the trial has 9 of 16 control periods"):
        trial(steps=9).rollout(Joints(JOINTS), 16)


@pytest.mark.parametrize(("steps", "last"), [(1, 0.36), (2, 0.1), (3, 0.72)])
def test_a_trial_that_was_stopped_between_two_decisions_is_incomplete(steps, last):
    stopped = trial(steps=steps)
    stamps = 1000.0 + np.append(0.5 * np.arange(steps), 0.5 * (steps - 1) + last)
    stopped = dataclasses.replace(stopped, stamps=stamps)
    with pytest.raises(IncompleteTrialError, match=f"has {steps} of 16 control periods"):
        stopped.trial(Joints(JOINTS), 16, 0.5)


def test_a_trial_at_another_pace_is_told_by_its_decisions():
    with pytest.raises(IncompleteTrialError, match=r"decided every 0\.500 s; .* is 0\.25 s"):
        trial(steps=8).trial(Joints(JOINTS), 16, 0.25)


def test_a_missing_sample_is_named():
    holed = cut(trial(), [*range(6), *range(7, 17)])
    assert holed.missing == 1
    message = r"^1 sample is missing.* 1\.000 s pass after sample 5 at stamp 1002\.500 s.*busy\?$"
    with pytest.raises(IncompleteTrialError, match=message):
        holed.rollout(Joints(JOINTS), 15)


def test_a_command_whose_state_is_missing_is_named():
    whole = trial()
    positions = whole.positions.copy()
    positions[4] = np.nan
    holed = dataclasses.replace(whole, positions=positions)
    assert holed.missing == 1
    with pytest.raises(IncompleteTrialError, match=r"sample 4 at stamp 1002\.000 s"):
        holed.rollout(Joints(JOINTS), 16)


def test_an_unknown_joint_is_named():
    with pytest.raises(BagError, match="not recorded: knee; recorded joints: shoulder, elbow"):
        trial().rollout(Joints(("elbow", "knee")), 16)


def test_shapes_and_stamps_are_checked():
    whole = trial()
    with pytest.raises(BagError, match="velocities of a trajectory have shape"):
        dataclasses.replace(whole, velocities=whole.velocities[:, :2])
    with pytest.raises(BagError, match="stamps of a trajectory must rise"):
        dataclasses.replace(whole, stamps=whole.stamps[::-1])


def test_missing_in_counts_what_gaps_could_have_held():
    assert missing_in(np.array([0.0, 0.51, 1.0, 1.49])) == 0
    assert missing_in(np.array([0.0, 0.5, 1.0, 3.0, 3.5])) == 3
    assert missing_in(np.array([0.0, 5.0])) == 0


def test_a_trial_of_a_robot_with_an_unactuated_joint():
    joints = Joints(("cart", "pole"), unactuated=("pole",))
    nan = float("nan")
    trial = Trajectory(
        joint_names=("cart", "pole"),
        stamps=np.array([0.0, 0.1, 0.2]),
        positions=np.arange(6.0).reshape(3, 2),
        velocities=np.zeros((3, 2)),
        commands=np.array([[1.0, nan], [2.0, nan], [0.0, nan]]),
    )
    rollout = trial.rollout(joints, 2)
    np.testing.assert_array_equal(rollout.controls, [[1.0], [2.0]])
    assert rollout.states.shape == (3, 4)
