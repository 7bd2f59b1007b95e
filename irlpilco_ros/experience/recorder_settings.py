"""What the recorder must know: joints, how often, and where to."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from irlpilco_ros.experience.joint_state_cdr import NANOSECONDS
from irlpilco_ros.experience.motion import MotionSettings
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.settings import check, setting


@dataclass(frozen=True)
class RecorderSettings(MotionSettings):
    """What the recorder records, where to, and what of it a learner will take for the motion.

    Raises:
        InvalidSettingError: a value is out of its range, or there can be no such folder as the
            `output_directory` or `next_directory` that is named.
    """

    joints: tuple[str, ...] = setting(
        (), "Names of the joints to record; nothing is recorded while one of them is missing."
    )
    continuous_joints: tuple[str, ...] = setting(
        (), "Those of `joints` that turn without end: a wrap of their angle is no motion."
    )
    control_period: float = setting(
        0.5,
        "Time between two decisions of the policy that is to learn from it: how often samples are "
        "taken unless sample_rate is set.",
        unit="s",
        minimum=0.01,
        maximum=10.0,
    )
    sample_rate: float = setting(
        0.0,
        "Samples per second of message time, as long as there are no commands; 0: one for each "
        "control_period.",
        unit="Hz",
        minimum=0.0,
        maximum=1000.0,
    )
    full_rate: bool = setting(
        True,
        "Whether all joint states and commands are kept, too, on topics of their own "
        "(joint_states/full_rate) beside the samples.",
    )
    output_directory: str = setting(
        "recordings",
        "Folder that gets the bags, 000, 001, ...; a relative path begins where the node was "
        "started. Counts from the next `start` on.",
    )
    next_directory: str = setting(
        "",
        "Folder that gets the next recording in place of `output_directory`, if `start` comes "
        "within 10 s; then it is empty again. A learner sets it for each trial.",
    )

    def __post_init__(self) -> None:
        check(self)
        _ = self.directory

    @property
    def period(self) -> int:
        """Time between samples as long as there are no commands [ns]."""
        seconds = 1.0 / self.sample_rate if self.sample_rate else self.control_period
        return round(seconds * NANOSECONDS)

    @property
    def directory(self) -> Path:
        """The folder that gets the next recording, as an absolute path.

        Raises:
            InvalidSettingError: it is not named, or lies in the home of a user that is not there.
        """
        if not self.output_directory.strip():
            raise InvalidSettingError(
                "output_directory is empty; name the folder that gets the bags, such as recordings"
            )
        own = _folder("output_directory", self.output_directory)
        return _folder("next_directory", self.next_directory) if self.next_directory else own


def _folder(name: str, value: str) -> Path:
    """Return the folder that a setting names, as an absolute path.

    Raises:
        InvalidSettingError: it lies in the home of a user that is not there.
    """
    try:
        return Path(value).expanduser().absolute()
    except RuntimeError as error:
        raise InvalidSettingError(
            f"{name} is {value!r}, but there is no such user's home; name a folder by its path"
        ) from error
