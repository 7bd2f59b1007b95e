"""`irlpilco inspect`: what is in a bag, in a folder of bags or in a run, for people."""

from __future__ import annotations

import os
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from irlpilco_ros.experience.appraisal import appraisal
from irlpilco_ros.experience.bag_files import DAMAGED, DISCARDED, entries, is_bag
from irlpilco_ros.experience.bag_reader import Recording, read_recording
from irlpilco_ros.experience.best_trial import best_sentence
from irlpilco_ros.experience.errors import BagError, RunDirectoryError
from irlpilco_ros.experience.joint_state_cdr import NANOSECONDS
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.experience.shown_motion import Window
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.learning.joints import Joints

_DEEPEST = 2  # a run holds demonstration/NNN


def inspect(
    path: Path, topic: str = "", robot: RobotSettings | None = None, window: Window = ()
) -> str:
    """Return several lines that say what a bag holds, and whether it is whole.

    For a run or another folder of bags, one line for each bag in it, and of a run which trial is
    the best.

    Args:
        path: The bag's folder or its only file, or a folder of bags; it is only read.
        topic: Which topic of joint states to take, where several tell the same joints.
        robot: Robot that is to learn from it; None to leave open what it is good for.
        window: Part of a demonstration that the robot is to imitate [s]; empty for its motion.

    Raises:
        BagError: there is no bag, or it cannot be read.
    """
    if not is_bag(path) and os.path.isdir(path):
        return _list(path, topic)
    recording = read_recording(path, full_rate=robot is not None)
    lines = [f"{path}: {_condition(recording)}", *_topics(recording)]
    try:
        samples = recording.trajectory(topic, robot.joints if robot else ())
    except BagError as error:
        return "\n".join([*lines, f"no trajectory: {error}"])
    lines += [*_samples(samples), *_joints(samples)]
    if robot is not None:
        lines += appraisal(samples, recording.path_taken(topic, robot.joints), robot, window)
    return "\n".join(lines)


def _list(folder: Path, topic: str) -> str:
    """Return a line for every bag below a folder."""
    bags = list(_bags_below(folder, _DEEPEST))
    if not bags:
        raise BagError(f"{folder} is no bag, and there is none in it")
    lines = [f"{folder}: {len(bags)} bag{'s' if len(bags) > 1 else ''}", *_best(folder)]
    names = [str(bag.relative_to(folder)) for bag in bags]
    width = max(map(len, names))
    for name, bag in zip(names, bags, strict=True):
        lines.append(f"  {name.ljust(width)}  {_one_line(bag, topic)}")
    return "\n".join(lines)


def _best(folder: Path) -> list[str]:
    """Return which trial of a run is the best; nothing if the folder is no run."""
    run = RunDirectory(folder)
    if not os.path.exists(run.metrics_file):
        return []
    try:
        return [best_sentence(run)]
    except RunDirectoryError as error:
        return [f"best: not known: {error}"]


def _bags_below(folder: Path, depth: int) -> Iterator[Path]:
    for entry in entries(folder):
        if is_bag(entry):
            yield entry
        elif depth and os.path.isdir(entry) and not os.path.islink(entry):
            yield from _bags_below(entry, depth - 1)


def _one_line(bag: Path, topic: str) -> str:
    try:
        recording = read_recording(bag)
    except BagError as error:
        return f"cannot be read: {error}"
    try:
        samples = recording.trajectory(topic)
    except BagError as error:
        return f"{_condition(recording)}; no trajectory: {error}"
    return f"{_condition(recording)}; {len(samples)} samples; {_content(samples)}"


def _condition(recording: Recording) -> str:
    name = recording.path.name
    marks = [mark.strip(".") for mark in (DISCARDED, DAMAGED) if name.endswith(mark)]
    if "recovered_from" in recording.custom:
        marks.append(f"recovered from {recording.custom['recovered_from']}")
    if recording.whole:
        return ", ".join(["whole", *marks])
    wrong = [*recording.damage, *recording.torn]
    if recording.metadata_problem:
        wrong.append(recording.metadata_problem)
    cure = "(irlpilco recover makes a whole bag of it)" if recording.message_count else ""
    return ", ".join([f"not whole: {'; '.join(wrong)} {cure}".rstrip(), *marks])


def _topics(recording: Recording) -> list[str]:
    if not recording.message_count:
        return ["no messages"]
    seconds = (recording.last - recording.first) / NANOSECONDS
    return [
        f"recorded {_date(recording.first)}, {seconds:.2f} s by the wall clock",
        *(
            f"  {number:5d}  {topic.name}  {topic.message_type or 'of no type'}"
            for topic, number in recording.counts.items()
        ),
    ]


def _date(time: int) -> str:
    """Return a time [ns] as a date, or as a number where it is none."""
    try:
        start = datetime.fromtimestamp(0, UTC) + timedelta(seconds=time / NANOSECONDS)
    except OverflowError:
        return f"at {time} ns"
    return f"{start:%Y-%m-%d %H:%M:%S} UTC"


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
    # Only a trial tells what the control period is.
    pace = "" if samples.commanded.any() else f" if one is {samples.cadence:.3f} s"
    return f"{kind} of {steps} control periods{pace}"


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
