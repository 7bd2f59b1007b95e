"""`irlpilco inspect`: what is in a bag, for people."""

from __future__ import annotations

from collections import Counter
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from irlpilco_ros.experience.bag_files import DISCARDED
from irlpilco_ros.experience.bag_reader import Recording, read_recording, trajectory
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.joint_state_cdr import NANOSECONDS
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.learning.joints import Joints


def inspect(path: Path) -> str:
    """Return several lines that say what a bag holds, and whether it is whole.

    Args:
        path: The bag's folder or its .mcap file; it is only read.

    Raises:
        BagError: there is no bag, or it cannot be read.
    """
    recording = read_recording(path)
    lines = [f"{path}: {_condition(recording)}", *_topics(recording)]
    try:
        samples = trajectory(recording)
    except BagError as error:
        return "\n".join([*lines, f"no trajectory: {error}"])
    return "\n".join([*lines, *_samples(samples), *_joints(samples)])


def _condition(recording: Recording) -> str:
    marks = ["discarded"] if recording.path.name.endswith(DISCARDED) else []
    if "recovered_from" in recording.custom:
        marks.append(f"recovered from {recording.custom['recovered_from']}")
    if recording.whole:
        return ", ".join(["whole", *marks])
    where = "not closed" if recording.torn_at is None else f"torn after byte {recording.torn_at}"
    return ", ".join([f"{where} (irlpilco recover makes a whole bag of it)", *marks])


def _topics(recording: Recording) -> list[str]:
    if not recording.messages:
        return ["no messages"]
    times = [message.log_time for message in recording.messages]
    start = datetime.fromtimestamp(min(times) / NANOSECONDS, UTC)
    seconds = (max(times) - min(times)) / NANOSECONDS
    lines = [f"recorded {start:%Y-%m-%d %H:%M:%S} UTC, {seconds:.2f} s by the wall clock"]
    counts = Counter(message.topic for message in recording.messages)
    lines += [
        f"  {number:5d}  {topic.name}  {topic.message_type}" for topic, number in counts.items()
    ]
    return lines


def _samples(samples: Trajectory) -> list[str]:
    if not len(samples):
        return ["samples: none"]
    span = samples.stamps[-1] - samples.stamps[0]
    return [
        f"samples: {len(samples)} over {span:.2f} s, every {samples.cadence:.3f} s, "
        f"{samples.missing} missing",
        f"content: {_content(samples)}",
    ]


def _content(samples: Trajectory) -> str:
    kind = "trial" if samples.commanded.any() else "demonstration"
    try:
        steps = samples.rollout(_roles(samples)).steps
    except BagError as error:
        return f"no whole {kind}: {error}"
    return f"{kind} of {steps} control periods"


def _roles(samples: Trajectory) -> Joints:
    """Return the joints; those that no command ever named are unactuated."""
    silent = np.isnan(samples.commands).all(axis=0)
    unactuated = () if silent.all() else tuple(np.array(samples.joint_names)[silent].tolist())
    return Joints(samples.joint_names, unactuated)


def _joints(samples: Trajectory) -> list[str]:
    if not samples.observed.any():
        return []
    width = max(len(name) for name in samples.joint_names)
    heads = ("first", "last", "lowest", "highest [rad]", "fastest [rad/s]")
    lines = ["joint".ljust(width) + "".join(head.rjust(17) for head in heads)]
    positions = samples.positions[samples.observed]
    speeds = np.abs(samples.velocities[samples.observed]).max(axis=0)
    columns = (positions[0], positions[-1], positions.min(axis=0), positions.max(axis=0), speeds)
    for name, *values in zip(samples.joint_names, *columns, strict=True):
        lines.append(name.ljust(width) + "".join(f"{value:17.4f}" for value in values))
    return lines
