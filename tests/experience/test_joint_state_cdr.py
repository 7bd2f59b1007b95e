from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage, StreamReader, decode, encode

NAMES = st.lists(st.text("abcdefgh_0123", max_size=12), max_size=5).map(tuple)
STAMPS = st.integers(0, 2**31 * 10**9 - 1)
NUMBERS = st.floats(allow_nan=False)


@st.composite
def messages(draw):
    names = draw(NAMES)
    values = st.lists(NUMBERS, min_size=len(names), max_size=len(names)).map(tuple)
    either = values | st.just(())
    return JointStateMessage(draw(STAMPS), names, draw(either), draw(either), draw(either))


@given(messages())
def test_a_message_survives_its_bytes(message):
    assert decode(encode(message)) == message


@given(st.lists(messages(), max_size=8))
def test_the_stream_reader_reads_what_decoding_reads(stream):
    reader = StreamReader()
    for message in stream:
        for _ in range(2):
            reading = reader.read(encode(message))
            assert reading[:2] == (message.stamp, message.names)
            assert tuple(reading.positions) == message.positions
            assert tuple(reading.velocities) == message.velocities
            assert tuple(reading.efforts) == message.efforts
            assert tuple(reading.command) == message.command


def test_names_that_change_within_the_same_length_are_noticed():
    reader = StreamReader()
    for names in (("ab", "cd"), ("ab", "ce"), ("ab", "cd")):
        assert reader.read(encode(JointStateMessage(1, names, (1.0, 2.0))))[1] == names


def test_other_bytes_are_refused():
    with pytest.raises(BagError, match="are no sensor_msgs/msg/JointState"):
        StreamReader().read(b"\x00\x01\x00\x00 something else altogether")
