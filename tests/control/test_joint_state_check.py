"""What is right and what is not about joint states, one bad habit at a time."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
from robot_of_two import JOINTS, ROBOT, nanoseconds

from irlpilco_ros.control.controller_settings import ControllerSettings
from irlpilco_ros.control.joint_state_check import Arrival, check_joint_states
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage

BEGIN = 1_700_000_000.0
RATE = 100


def states(seconds=2.0, rate=RATE, speed=0.1):
    """A robot as it should be: the elbow swings, the wrist rests."""
    for k in range(round(seconds * rate)):
        time = k / rate
        yield Arrival(
            BEGIN + time + 0.002,
            JointStateMessage(
                nanoseconds(BEGIN + time),
                JOINTS,
                (speed * np.sin(time), 0.5),
                (speed * np.cos(time), 0.0),
                (1.0, 0.5),
            ),
        )


def changed(arrivals, **fields):
    """Change fields of each message; a function gets the message's number."""
    return [
        dataclasses.replace(
            each,
            message=dataclasses.replace(
                each.message,
                **{key: value(k) if callable(value) else value for key, value in fields.items()},
            ),
        )
        for k, each in enumerate(arrivals)
    ]


def found(arrivals, robot=ROBOT):
    return check_joint_states(robot, ControllerSettings(), list(arrivals), 2.0)


def test_a_robot_as_it_should_be_is_right_in_every_line():
    lines = found(states())
    assert all(each.is_right for each in lines), [str(each) for each in lines]
    assert [each.text.partition(":")[0] for each in lines] == [
        "names", "rate", "gaps", "stamps", "velocities", "clock", "positions", "efforts",
    ]  # fmt: skip
    told = "\n".join(map(str, lines))
    assert "ok    rate: 100.0 Hz" in told
    assert "gaps: 10 ms at most" in told
    assert "velocities: true to the positions (elbow moved 0.100 rad)" in told


BAD = {
    r"names: nothing of wrist": changed(
        states(), names=("elbow",), positions=(0.0,), velocities=(0.0,), efforts=()
    ),
    r"rate: 8\.0 new states a second of elbow; expected 17": list(states(rate=8)),
    r"gaps: 0\.4\d s without a new state of elbow": [
        each for k, each in enumerate(states()) if not 80 < k < 120
    ],
    r"stamps: zero": changed(states(), stamp=0),
    r"stamps: those of elbow run back, \d+ times, by up to 0\.090 s": changed(
        states(), stamp=lambda k: nanoseconds(BEGIN + k / RATE - 0.1 * (k % 10 == 9))
    ),
    r"rate: 10\.0 new states a second": changed(
        states(), stamp=lambda k: nanoseconds(BEGIN + k // 10 / 10)
    ),
    r"clock: stamps are 3\.00 s behind this computer's clock": changed(
        states(), stamp=lambda k: nanoseconds(BEGIN + k / RATE - 3.0)
    ),
    r"clock: stamps are 5\.00 s ahead of": changed(
        states(), stamp=lambda k: nanoseconds(BEGIN + k / RATE + 5.0)
    ),
    r"clock: stamps are 19\d+\.\d days behind": changed(
        states(), stamp=lambda k: nanoseconds(1.0 + k / RATE)
    ),
    r"clock: stamps went on by 1\.\d\d s in 1\.99 s": changed(
        states(), stamp=lambda k: nanoseconds(BEGIN + 0.8 * k / RATE)
    ),
    r"velocities: missing, or no numbers, of elbow, wrist": changed(states(), velocities=()),
    r"velocities: missing, or no numbers, of wrist": changed(
        states(), velocities=lambda k: (0.1 * np.cos(k / RATE), np.nan)
    ),
    r"velocities: those of elbow do not add up": changed(states(), velocities=(0.0, 0.0)),
    r"velocities: those of wrist do not add up": changed(
        states(), velocities=lambda k: (0.1 * np.cos(k / RATE), 0.1)
    ),
    r"positions: wrist is at 1\.2000 rad, beyond its limits \[-1, 1\]": changed(
        states(), positions=lambda k: (0.1 * np.sin(k / RATE), 1.2)
    ),
    r"positions: one of wrist is no number": changed(
        states(), positions=lambda k: (0.1 * np.sin(k / RATE), np.inf)
    ),
    r"efforts: wrist tells 40\.00 of 3 Nm, which would stop it": changed(
        states(), efforts=(1.0, 40.0)
    ),
    r"joint states: 0 in 2 s; expected some of elbow, wrist": [],
    r"joint states: 200 in 2 s, which told of a, b": changed(states(), names=("a", "b")),
}


@pytest.mark.parametrize("reason", BAD)
def test_a_bad_habit_is_told_and_little_else(reason):
    wrong = [each.text for each in found(BAD[reason]) if not each.is_right]
    assert any(re.search(reason, text) for text in wrong), wrong
    assert len(wrong) <= 3, wrong


def test_degrees_for_radians_in_the_velocities_are_found():
    degrees = changed(states(), velocities=lambda k: (np.degrees(0.1 * np.cos(k / RATE)), 0.0))
    assert any("do not add up" in each.text for each in found(degrees))


def test_a_robot_that_rests_leaves_it_open_whether_velocities_are_true():
    lines = found(states(speed=0.0))
    assert all(each.is_right for each in lines)
    assert any("nothing moved" in each.text for each in lines)


def test_joints_in_messages_of_their_own_are_merged():
    def split(arrivals):
        for each in arrivals:
            for j, name in enumerate(JOINTS):
                message = JointStateMessage(
                    each.message.stamp,
                    (name,),
                    each.message.positions[j : j + 1],
                    each.message.velocities[j : j + 1],
                )
                yield dataclasses.replace(each, message=message)

    assert all(each.is_right for each in found(split(states())))


def test_a_wrap_of_a_joint_without_end_is_no_motion():
    robot = dataclasses.replace(
        ROBOT,
        continuous_joints=("elbow",),
        position_lower=(-1000.0, -1.0),
        position_upper=(1000.0, 1.0),
    )
    wrapped = changed(
        states(),
        positions=lambda k: ((3.0 + 0.2 * k / RATE + np.pi) % (2.0 * np.pi) - np.pi, 0.5),
        velocities=(0.2, 0.0),
    )
    assert all(each.is_right for each in found(wrapped, robot))
    assert not all(each.is_right for each in found(wrapped))  # as for a joint that has an end


def test_a_simulation_that_waits_for_commands_is_right():
    standing = [
        Arrival(BEGIN + k * 0.05, each.message, simulated_time=7.0)
        for k, each in enumerate(changed(list(states())[:40], stamp=nanoseconds(7.0)))
    ]
    still = changed(standing, positions=(0.1, 0.5), velocities=(0.0, 0.0))
    lines = found(still)
    assert all(each.is_right for each in lines), [str(each) for each in lines]
    assert "the simulation waits" in lines[1].text


def test_near_a_limit_is_said_but_not_wrong():
    lines = found(changed(states(speed=0.0), positions=(0.0, 0.97)))
    assert all(each.is_right for each in lines)
    assert any("within position_margin of one: wrist" in each.text for each in lines)
