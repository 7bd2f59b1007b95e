from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irlpilco_ros.experience.joint_merging import Moment, Received
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage, decode, encode
from irlpilco_ros.experience.sampling import MEMORY, Sampler

JOINTS = ("a", "b")
TICK = 10_000_000
PERIOD = 500_000_000


def message(stamp: int, names=JOINTS, speed: float = 0.5) -> Received:
    values = np.full(len(names), speed)
    data = encode(JointStateMessage(stamp, names, (), tuple(values), ()))
    return Received(stamp, names, values, values, data, stamp + 3, stamp + 1)


def moment(stamp: int, *parts: Received, whole: bool = True) -> Moment:
    return Moment(stamp, parts or (message(stamp),), whole)


def stamps(samples) -> list[int]:
    return [sample.states[-1].stamp for sample in samples]


def feed(sampler: Sampler, *states: int):
    return [sample for stamp in states for sample in sampler.take_state(moment(stamp))]


def test_without_commands_the_first_state_at_or_after_each_period():
    sampler = Sampler(JOINTS, PERIOD)
    times = [7 + k * TICK for k in range(151)]
    assert stamps(feed(sampler, *times)) == [7 + k * PERIOD for k in range(4)]
    slow = Sampler(JOINTS, PERIOD)  # 3 Hz: the grid of periods does not shift
    third = 333_333_333
    sampled = stamps(feed(slow, *(k * third for k in range(10))))
    assert sampled == [0, 2 * third, 3 * third, 5 * third, 6 * third, 8 * third, 9 * third]


def test_a_gap_does_not_bring_the_periods_out_of_step():
    sampler = Sampler(JOINTS, PERIOD)
    times = [*range(0, PERIOD, TICK), *range(2 * PERIOD + 3 * TICK, 4 * PERIOD + TICK, TICK)]
    expected = [0, 2 * PERIOD + 3 * TICK, 3 * PERIOD, 4 * PERIOD]
    assert stamps(feed(sampler, *times)) == expected


def test_commands_of_other_joints_make_no_samples():
    sampler = Sampler(JOINTS, 1)
    assert len(feed(sampler, 5)) == 1
    assert sampler.take_command(message(5, ("gripper",))) == []


def test_a_sample_has_every_message_that_tells_a_joint():
    sampler = Sampler(JOINTS, PERIOD)
    left, right = message(1, ("a",)), message(2, ("b", "c"))
    assert sampler.take_state(moment(1, left, right, whole=False)) == []
    (sample,) = sampler.take_state(moment(2, left, right))
    assert sample.states == (left, right)


def test_what_is_not_whole_makes_a_sample_only_if_a_command_was_decided_on_it():
    sampler = Sampler(JOINTS, TICK)
    feed(sampler, TICK)
    left, right = message(3 * TICK, ("a",)), message(TICK, ("b",))
    assert sampler.take_state(moment(3 * TICK, right, left, whole=False)) == []
    (sample,) = sampler.take_command(message(3 * TICK))
    assert sample.states == (right, left)


def test_of_two_messages_with_one_stamp_the_first_is_what_was_acted_upon():
    sampler = Sampler(JOINTS, PERIOD)
    feed(sampler, TICK)
    left, right, old = message(9, ("a",)), message(9, ("b",)), message(8, ("b",))
    sampler.take_state(moment(9 + TICK, old, left, whole=False))
    sampler.take_state(moment(9 + TICK, left, right))
    (sample,) = sampler.take_command(message(9 + TICK))
    assert sample.states == (old, left)


def test_a_command_takes_its_state_with_it_once():
    sampler = Sampler(JOINTS, PERIOD)
    assert len(feed(sampler, 0, TICK, 2 * TICK)) == 1
    (sample,) = sampler.take_command(message(TICK))
    assert stamps([sample]) == [TICK]
    assert sampler.take_command(message(TICK)) == []
    (sample,) = sampler.take_command(message(2 * TICK))
    assert stamps([sample]) == [2 * TICK]


def test_a_command_on_a_state_that_is_written_already_comes_alone():
    sampler = Sampler(JOINTS, PERIOD)
    assert stamps(feed(sampler, 0, PERIOD)) == [0, PERIOD]
    (sample,) = sampler.take_command(message(0))
    assert sample.states == ()
    assert sample.command.stamp == 0


def test_a_command_that_overtakes_its_state_waits_for_it():
    sampler = Sampler(JOINTS, PERIOD)
    feed(sampler, 0)
    assert sampler.take_command(message(TICK)) == []
    assert sampler.is_waiting
    (sample,) = feed(sampler, TICK)
    assert stamps([sample]) == [TICK]
    assert sample.command.stamp == TICK
    assert not sampler.is_waiting


def test_a_command_whose_state_never_comes_is_recorded_alone():
    sampler = Sampler(JOINTS, PERIOD)
    feed(sampler, 0)
    sampler.take_command(message(TICK))
    late = [sample for sample in feed(sampler, MEMORY, 2 * MEMORY) if sample.command]
    assert [(sample.states, sample.command.stamp) for sample in late] == [((), TICK)]
    sampler.take_command(message(9 * MEMORY))
    (sample,) = sampler.drain()
    assert sample.command.stamp == 9 * MEMORY


def test_a_command_from_before_the_recording_is_nobodys():
    sampler = Sampler(JOINTS, PERIOD)
    sampler.take_command(message(5))
    feed(sampler, TICK, 2 * MEMORY)
    assert not sampler.is_waiting
    assert sampler.drain() == []


def test_while_commands_come_there_are_no_samples_in_between():
    sampler = Sampler(JOINTS, PERIOD)
    found = []
    decided = start = 23 * TICK
    for k in range(300):
        stamp = k * TICK
        found += sampler.take_state(moment(stamp))
        if start <= stamp <= start + 4 * PERIOD:
            decided = stamp if (stamp - start) % PERIOD == 0 else decided
            found += sampler.take_command(message(decided))
    ticks = [start + k * PERIOD for k in range(5)]
    assert stamps(found) == [0, *ticks, ticks[-1] + PERIOD]
    assert [sample.command is not None for sample in found] == [False, *[True] * 5, False]


def kept(sampler: Sampler, *speeds: float, stamp: int = TICK) -> list[float]:
    """What is kept of commands of these speeds, all sent on one decision."""
    samples = [
        sample for speed in speeds for sample in sampler.take_command(message(stamp, JOINTS, speed))
    ]
    assert [bool(sample.states) for sample in samples] == [True, *[False] * (len(samples) - 1)]
    return [decode(sample.command.data).command[0] for sample in samples]


@pytest.mark.parametrize(
    ("sent", "ends", "differs"),
    [
        ((0.3, 0.3, 0.3), [0.3], [0.3]),
        ((0.3, 0.2, 0.1, 0.0, 0.0), [0.3, 0.0, 0.0], [0.3, 0.2, 0.1, 0.0, 0.0]),
        ((0.3, 0.4, 0.5, 0.5), [0.3], [0.3, 0.4, 0.5, 0.5]),
        ((0.0, 0.0), [0.0], [0.0]),
    ],
)
def test_of_what_else_is_sent_on_a_decision_the_end_is_kept_or_all_that_differs(
    sent, ends, differs
):
    for all_commands, expected in ((False, ends), (True, differs)):
        sampler = Sampler(JOINTS, PERIOD, all_commands)
        feed(sampler, 0, TICK)
        assert kept(sampler, *sent) == expected


def test_the_end_waits_with_its_decision_for_their_state():
    sampler = Sampler(JOINTS, PERIOD)
    feed(sampler, 0)
    for speed in (0.3, 0.1, 0.0):
        assert sampler.take_command(message(TICK, JOINTS, speed)) == []
    decided, end = feed(sampler, TICK)
    assert stamps([decided]) == [TICK]
    assert decode(decided.command.data).command == (0.3, 0.3)
    assert end.states == ()
    assert decode(end.command.data).command == (0.0, 0.0)


@given(st.data())
def test_every_command_finds_its_state_in_whatever_order_they_arrive(data):
    """Topics keep their own order, but not between each other; a lag stays within the memory."""
    states = [message(k * TICK) for k in range(60)]
    decided = sorted(data.draw(st.sets(st.integers(0, 59), min_size=1, max_size=8)))
    commands = [message(states[k].stamp) for k in decided]
    order = data.draw(st.permutations([True] * len(states) + [False] * len(commands)))
    sampler, found = Sampler(JOINTS, 3 * TICK), []
    for is_state in order:
        if is_state:
            found += sampler.take_state(moment(states[0].stamp, states.pop(0)))
        else:
            found += sampler.take_command(commands.pop(0))
    assert sampler.drain() == []
    written = [state.stamp for sample in found for state in sample.states]
    assert len(written) == len(set(written))  # no state twice
    pairs = [sample.command.stamp for sample in found if sample.command]
    assert sorted(pairs) == [k * TICK for k in decided]
    assert set(pairs) <= set(written)
    for sample in found:
        if sample.command is not None and sample.states:
            assert sample.states[-1].stamp == sample.command.stamp
