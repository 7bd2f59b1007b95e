"""The motions that come with the package, and those of a user's own files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from irlpilco_ros.experience.errors import FileError
from irlpilco_ros.experience.plain_files import read_yaml
from irlpilco_ros.learning.errors import InvalidSettingError
from sim_bridge.guided_motion import GuidedMotion
from sim_bridge.hand_motion import HandMotion

_FOLDER = Path(__file__).parent / "demonstrations"
BY_HAND = _FOLDER / "sweep_by_hand.yaml"
"""The sweep as a person shows it."""
CORNERED = _FOLDER / "cornered_sweep.yaml"
"""The sweep in straight lines whose corners lie 0.5 s apart, as a controller at 2 Hz moves."""
WIPE = _FOLDER / "wipe.yaml"

_NAMED = {each.stem: each for each in (BY_HAND, CORNERED, WIPE)}
_COURSES = {"straight": GuidedMotion, "hand": HandMotion}


def load_motion(path: Path | str = BY_HAND) -> GuidedMotion:
    """Read a motion: a YAML file with `joints`, `interval` [s] and `positions` [rad].

    A bare name, such as "cornered_sweep", is that of a motion of the package.

    With `course: hand` it is shown as a hand does, smoothly past the positions; without, straight
    from one to the next.

    Raises:
        InvalidSettingError: the file cannot be read, lacks a key or holds something else.
    """
    if str(path) in _NAMED:
        path = _NAMED[str(path)]
    try:
        document = read_yaml(Path(path))
    except FileError as error:
        raise InvalidSettingError(f"cannot read a motion: {error}") from error
    try:
        joints = tuple(str(name) for name in document["joints"])
        positions = np.array(document["positions"], dtype=float)
        interval = float(document["interval"])
        kind = _COURSES[document.get("course", "straight")]
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InvalidSettingError(
            f"cannot read a motion from {path}: {error!r}; expected the keys joints, interval [s] "
            f"and positions [rad], and course: hand or straight, as in {BY_HAND}"
        ) from error
    return kind(joints, interval, positions)
