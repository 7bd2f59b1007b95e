"""The places at which a run practises: where its object was, how fast, and what is imitated there.

Place 0 is where it was shown, as fast as it was shown. RUN/places/NNN.npz holds each other one, in
the order in which they came: the object's pose, the speed, the demonstrations carried over, and the
iteration that was the first for it. Each lasts until the next begins.
"""

from __future__ import annotations

import bisect
import io
import re
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.experience.errors import FileError, RunDirectoryError
from irlpilco_ros.experience.plain_files import open_regular
from irlpilco_ros.experience.shown_motion import ShownMotion
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.rollout import Rollout

_LIMIT = 1 << 28
"""Largest size of all arrays of a file [bytes]."""

SAME = 1e-6
"""Poses that differ by less, in metres and parts of 1, are one place."""


@dataclass(frozen=True)
class Place:
    """A place at which a motion is practised, and at which speed.

    Attributes:
        first: Iteration that was the first for it.
        object_pose: Where the object is, in the base frame, (4, 4); None for where it was shown, if
            nobody told where that is.
        shown: The demonstrations, carried over; none if they are done where and as they were shown.
        speed: How many times as fast they are done as they were shown.
        move: The rigid motion of the object since the first demonstration, in the base frame,
            (4, 4); None for none.
    """

    first: int
    object_pose: Array | None
    shown: tuple[ShownMotion, ...]
    speed: float = 1.0
    move: Array | None = None

    def is_at(self, object_pose: Array | None, speed: float) -> bool:
        """Whether an object in this pose is at this place, and so fast is what is done there."""
        mine = self.object_pose
        if speed != self.speed or mine is None or object_pose is None:
            return speed == self.speed and mine is object_pose
        return bool(np.abs(mine - object_pose).max() <= SAME)


def place_file(folder: Path, number: int) -> Path:
    """Return the path of a place's file; numbers begin with 1."""
    return folder / f"{number:03d}.npz"


def read_places(folder: Path) -> list[Place]:
    """Return all places but the demonstrated one, in order.

    Raises:
        RunDirectoryError: a file is missing, or holds something else.
    """
    names = (path.name for path in folder.glob("*.npz"))
    count = sum(re.fullmatch(r"\d{3,}\.npz", name) is not None for name in names)
    return [_read(place_file(folder, number)) for number in range(1, count + 1)]


def iterations_here(folder: Path) -> Callable[[int], bool]:
    """Return what tells whether an iteration was for the place where the object is now.

    Raises:
        RunDirectoryError: a place cannot be read.
    """
    places = read_places(folder)
    if not places:
        return lambda iteration: True
    starts = [place.first for place in places]

    def is_here(iteration: int) -> bool:
        number = bisect.bisect_right(starts, iteration)
        if not number:
            return not places[-1].shown
        return places[-1].is_at(places[number - 1].object_pose, places[number - 1].speed)

    return is_here


def write_place(path: Path, place: Place) -> None:
    """Write a place.

    Raises:
        FileError: it cannot be written.
    """
    arrays: dict[str, np.ndarray] = {
        "first": np.asarray(place.first),
        "speed": np.asarray(place.speed),
        "count": np.asarray(len(place.shown)),
    }
    if place.object_pose is not None:
        arrays["object_pose"] = place.object_pose
    if place.move is not None:
        arrays["move"] = place.move
    if place.shown:
        joints = place.shown[0].samples.joint_names
        arrays["joints"] = np.asarray(joints, dtype=np.str_)
    for number, shown in enumerate(place.shown):
        samples = shown.samples
        arrays |= {
            f"begin_{number}": np.asarray(shown.begin),
            f"states_{number}": shown.rollout.states,
            f"controls_{number}": shown.rollout.controls,
            f"stamps_{number}": samples.stamps,
            f"positions_{number}": samples.positions,
            f"velocities_{number}": samples.velocities,
        }
    stream = io.BytesIO()
    np.savez(stream, **arrays)  # type: ignore[arg-type]
    path.parent.mkdir(exist_ok=True)
    write_atomically(path, stream.getvalue())


def _read(path: Path) -> Place:
    try:
        with open_regular(path) as file:
            with zipfile.ZipFile(file) as archive:
                size = sum(entry.file_size for entry in archive.infolist())
            if size > _LIMIT:
                raise ValueError(f"it unpacks to {size} bytes; up to {_LIMIT} are read")
            file.seek(0)
            with np.load(file, allow_pickle=False) as arrays:
                return _place(arrays)
    except FileError as error:
        raise RunDirectoryError(str(error)) from error
    except Exception as error:  # numpy and zipfile raise whatever a damaged file makes them
        raise RunDirectoryError(f"cannot read the place {path}: {error!r}") from error


def _place(arrays: np.lib.npyio.NpzFile) -> Place:
    shown, count = [], int(arrays["count"])
    joints = tuple(str(name) for name in arrays["joints"]) if count else ()
    for number in range(count):
        stamps, positions = arrays[f"stamps_{number}"], arrays[f"positions_{number}"]
        velocities = arrays[f"velocities_{number}"]
        nothing = np.full_like(positions, np.nan)
        samples = Trajectory(joints, stamps, positions, velocities, nothing)
        rollout = Rollout(arrays[f"states_{number}"], arrays[f"controls_{number}"])
        shown.append(ShownMotion(rollout, samples, None, float(arrays[f"begin_{number}"])))
    object_pose, move = arrays.get("object_pose"), arrays.get("move")
    for pose in (object_pose, move):
        if pose is not None and (pose.shape != (4, 4) or not np.isfinite(pose).all()):
            raise ValueError("it holds no pose")
    speed = float(arrays.get("speed", 1.0))  # it was not told before there were others
    return Place(int(arrays["first"]), object_pose, tuple(shown), speed, move)
