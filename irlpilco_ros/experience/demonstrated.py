"""What a policy imitates, at the ticks of its trial: it is handed over with the policy.

Nothing is decided by it; the controller tells it, so that it can be plotted beside what the robot
does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from irlpilco_ros.experience.policy_file import DEMONSTRATED
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.numerics.arrays import Array

_DECIMALS = 7  # [rad]: a thousandth of what sensors tell


@dataclass(frozen=True)
class Demonstrated:
    """Where the joints were shown to be.

    Attributes:
        positions: At the ticks 0..H, shape (H + 1, J) [rad].
    """

    positions: Array

    def to_parameters(self) -> dict[str, list[float]]:
        """Return it as a parameter beside the policy's own, tick by tick."""
        return {DEMONSTRATED: self.positions.round(_DECIMALS).ravel().tolist()}

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any], joints: Joints) -> Demonstrated | None:
        """Return it from among ROS parameters; None if it is not there.

        Raises:
            InvalidSettingError: it does not fit the joints, or holds what is no position.
        """
        positions = np.array(parameters.get(DEMONSTRATED, ()), dtype=float)
        if not positions.size:
            return None
        count = len(joints.names)
        if positions.size % count:
            raise InvalidSettingError(
                f"{DEMONSTRATED} has {positions.size} values; expected one for each of {count} "
                "joints at every tick of a trial"
            )
        if not np.isfinite(positions).all():
            raise InvalidSettingError(f"{DEMONSTRATED} holds a number that is not finite")
        return cls(positions.reshape(-1, count))
