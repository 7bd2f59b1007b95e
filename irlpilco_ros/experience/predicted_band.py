"""Where the joints are expected at the ticks of a trial: it is handed over with the policy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from irlpilco_ros.experience.policy_file import PREDICTED
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.iteration import Iteration
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.numerics.arrays import Array

POSITIONS, DEVIATIONS = PREDICTED

_DECIMALS = 7  # [rad]: a thousandth of what sensors tell


@dataclass(frozen=True)
class PredictedBand:
    """What the model expects of a policy's trial, at the ticks 0..H.

    Attributes:
        positions: Means, shape (H + 1, J) [rad].
        deviations: Standard deviations of what will be measured, shape (H + 1, J) [rad].
    """

    positions: Array
    deviations: Array

    @property
    def horizon(self) -> int:
        """Number of decisions H."""
        return len(self.positions) - 1

    @classmethod
    def of(cls, iteration: Iteration, joints: Joints) -> PredictedBand | None:
        """Return what was predicted of an iteration's trial; None of the first, which is not."""
        if not len(iteration.predicted_means):
            return None
        count = len(joints.names)
        means, deviations = iteration.predicted_means, iteration.predicted_deviations
        return cls(means[:, :count], deviations[:, :count])

    def to_parameters(self) -> dict[str, list[float]]:
        """Return it as parameters beside the policy's own, tick by tick."""
        return {
            POSITIONS: self.positions.round(_DECIMALS).ravel().tolist(),
            DEVIATIONS: self.deviations.round(_DECIMALS).ravel().tolist(),
        }

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any], joints: Joints) -> PredictedBand | None:
        """Return the band among ROS parameters; None if there is none.

        Raises:
            InvalidSettingError: it does not fit the joints, or is made of what is no band.
        """
        positions, deviations = (
            np.array(parameters.get(name, ()), dtype=float) for name in (POSITIONS, DEVIATIONS)
        )
        if not positions.size and not deviations.size:
            return None
        count = len(joints.names)
        for name, values in ((POSITIONS, positions), (DEVIATIONS, deviations)):
            if values.size != positions.size or values.size % count or values.size < 2 * count:
                raise InvalidSettingError(
                    f"{name} has {values.size} values; expected one for each of {count} joints at "
                    "every tick of a trial, as many positions as deviations"
                )
            if not np.isfinite(values).all():
                raise InvalidSettingError(f"{name} holds a number that is not finite")
        if (deviations < 0.0).any():
            raise InvalidSettingError(f"{DEVIATIONS} holds a number below 0")
        return cls(positions.reshape(-1, count), deviations.reshape(-1, count))
