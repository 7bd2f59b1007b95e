from __future__ import annotations

import numpy as np
from example_trajectories import JOINTS, demonstration, torn_bag, trial

from irlpilco_ros.experience.bag_files import mark_discarded
from irlpilco_ros.experience.bag_writer import DurableBagWriter
from irlpilco_ros.experience.inspect import inspect
from irlpilco_ros.experience.recovery import recover
from irlpilco_ros.experience.trajectory_bag import write_trajectory


def test_a_whole_trial(tmp_path):
    text = inspect(write_trajectory(tmp_path, trial()))
    assert "000: whole" in text
    assert "samples: 17 over 8.00 s, every 0.500 s, 0 missing" in text
    assert "content: trial of 16 control periods" in text
    assert "17  /joint_command  sensor_msgs/msg/JointState" in text
    (row,) = [line for line in text.splitlines() if line.startswith("elbow")]
    whole = trial()
    numbers = [float(word) for word in row.split()[1:]]
    column = whole.positions[:, 1]
    speed = np.abs(whole.velocities[:, 1]).max()
    expected = [column[0], column[-1], column.min(), column.max(), speed]
    np.testing.assert_allclose(numbers, expected, atol=5e-5)


def test_a_demonstration_that_was_discarded(tmp_path):
    text = inspect(mark_discarded(write_trajectory(tmp_path, demonstration())))
    assert "whole, discarded" in text
    assert "content: demonstration of 16 control periods" in text


def test_a_torn_bag_says_where_and_what_to_do(tmp_path):
    bag = torn_bag(tmp_path)
    text = inspect(bag)
    assert "torn after byte" in text
    assert "irlpilco recover" in text
    assert "content: no whole trial: the trial broke off after 16 commands" in text
    assert "recovered from 000" in inspect(recover(bag).path)


def test_an_empty_bag(tmp_path):
    with DurableBagWriter.numbered(tmp_path, {"joints": ",".join(JOINTS)}) as writer:
        pass
    text = inspect(writer.path)
    assert "no messages" in text
    assert "holds no messages" in text
