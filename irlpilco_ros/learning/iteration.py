"""What one pass of Algorithm 3 found out, and how it tells about its progress."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import Policy, from_arrays

_ARRAYS = (
    "weights",
    "predicted_means",
    "predicted_covariances",
)
_HYPERPARAMETERS = ("log_lengthscales", "log_signal", "log_noise")
_NUMBERS = ("margin", "cost", "model_seconds", "policy_seconds")
_COUNTS = ("index", "evaluations")


@dataclass(frozen=True)
class Progress:
    """Where learning stands.

    Attributes:
        stage: "weights", "model" or "policy".
        fraction: Part of the whole iteration that is done, 0 to 1.
        cost: Best cost so far; NaN before policy search.
        evaluations: Evaluations of the stage's objective so far.
        message: One readable line.
    """

    stage: str
    fraction: float
    cost: float
    evaluations: int
    message: str


@dataclass(frozen=True)
class Errors:
    """How far a trial was from the demonstration.

    Attributes:
        rmse: Root-mean-square error over features and steps t = 1..H, in the features' unit.
        mse: Its square, thesis (6.1).
    """

    rmse: float
    mse: float


@dataclass(frozen=True)
class Iteration:
    """One pass of Algorithm 3.

    Attributes:
        index: Number k of trials that it learned from.
        policy: The policy for the next trial.
        hyperparameters: Of the dynamics model.
        weights: Cost weights, shape (k,).
        margin: Margin of the weight rule over the trials so far.
        cost: Predicted cost of the policy.
        predicted_means: Predicted states, shape (H + 1, D).
        predicted_covariances: Their covariances, shape (H + 1, D, D).
        evaluations: Cost evaluations that the policy search took.
        model_seconds: Time spent on the dynamics model [s].
        policy_seconds: Time spent on policy search [s].
        learned: Whether the margin is within its tolerance.
        notes: What a reader should know, such as jitter that had to be added.
    """

    index: int
    policy: Policy
    hyperparameters: Hyperparameters
    weights: Array
    margin: float
    cost: float
    predicted_means: Array
    predicted_covariances: Array
    evaluations: int
    model_seconds: float
    policy_seconds: float
    learned: bool = False
    notes: tuple[str, ...] = ()

    def to_arrays(self) -> dict[str, Array]:
        """Return everything as named arrays for an npz file without pickles."""
        arrays = {name: np.asarray(getattr(self, name)) for name in _ARRAYS + _NUMBERS + _COUNTS}
        for name in _HYPERPARAMETERS:
            arrays[name] = getattr(self.hyperparameters, name)
        arrays["learned"] = np.asarray(self.learned)
        arrays["notes"] = np.asarray(self.notes, dtype=np.str_)
        arrays["policy_kind"] = np.asarray(self.policy.kind)
        for name, value in self.policy.to_arrays().items():
            arrays[f"policy_{name}"] = np.asarray(value)
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Any]) -> Iteration:
        """Return the iteration from what `to_arrays` made, for example an open npz file.

        Raises:
            InvalidSettingError: if an array is missing or the policy in it is not sound.
        """
        try:
            kind = str(arrays["policy_kind"])
            own = {
                name.removeprefix("policy_"): np.asarray(arrays[name])
                for name in arrays
                if name.startswith("policy_") and name not in ("policy_kind", "policy_seconds")
            }
            fields: dict[str, Any] = {name: np.asarray(arrays[name]) for name in _ARRAYS}
            fields["hyperparameters"] = Hyperparameters(
                **{name: np.asarray(arrays[name]) for name in _HYPERPARAMETERS}
            )
            fields |= {name: float(arrays[name]) for name in _NUMBERS}
            fields |= {name: int(arrays[name]) for name in _COUNTS}
            learned = bool(arrays["learned"])
            notes = tuple(str(note) for note in arrays["notes"])
        except KeyError as error:
            raise InvalidSettingError(
                f"an iteration needs the array {error}; it is missing"
            ) from error
        return cls(policy=from_arrays(kind, own), learned=learned, notes=notes, **fields)
