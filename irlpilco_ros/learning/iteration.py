"""What one pass of the loop found out, and how it tells about its progress."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import Policy, from_arrays
from irlpilco_ros.learning.rollout import Rollout

_ARRAYS = {"weights": "k", "predicted_means": "T D", "predicted_covariances": "T D D"}
_HYPERPARAMETERS = {"log_lengthscales": "E P", "log_signal": "E", "log_noise": "E"}
"""Shapes, letter by letter: the same letter stands for the same number. Iteration 0 has none."""

_DEVIATIONS = {"predicted_deviations": "T D"}
"""Files of earlier versions leave it out."""

_FURTHER = {"log_linear": "E", "log_repeated": "E"}
"""Of the hyperparameters, only where the model has such a part."""

_NUMBERS = ("margin", "cost", "model_seconds", "policy_seconds")
_COUNTS = ("index", "evaluations")


def _nothing() -> Array:
    return np.empty(0)


def _no_model() -> Hyperparameters:
    return Hyperparameters(np.empty((0, 0)), np.empty(0), np.empty(0))


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
class Iteration:
    """One pass of Algorithm 3 or 2. That of index 0 has nothing to learn from yet.

    Attributes:
        index: Number k of trials that it learned from.
        policy: The policy for the next trial; it sees `task.state_layout.policy_view(state)`.
        hyperparameters: Of the dynamics model; empty in iteration 0.
        weights: Cost weights of the features, shape (k,); empty where a cost is given.
        margin: Margin of the weight rule over the trials before; NaN where a cost is given.
        cost: Predicted cost of the policy.
        predicted_means: Predicted states, shape (H + 1, D); empty in iteration 0.
        predicted_covariances: Their covariances, shape (H + 1, D, D); empty in iteration 0.
        predicted_deviations: Standard deviations of what will be measured, corrected by how the
            trial before lay in its band, shape (H + 1, D); those of the prediction alone if they
            are not given (see `measured_band`).
        evaluations: Cost evaluations that the policy search took.
        model_seconds: Time spent on the dynamics model [s].
        policy_seconds: Time spent on policy search [s].
        learned: Whether the margin is within its tolerance.
        notes: What a reader should know, such as jitter that had to be added.
        tried: The trial of the policy; None before it was made. Files of iterations leave it out.
    """

    index: int
    policy: Policy
    hyperparameters: Hyperparameters = field(default_factory=_no_model)
    weights: Array = field(default_factory=_nothing)
    margin: float = math.nan
    cost: float = math.nan
    predicted_means: Array = field(default_factory=_nothing)
    predicted_covariances: Array = field(default_factory=_nothing)
    predicted_deviations: Array = field(default_factory=_nothing)
    evaluations: int = 0
    model_seconds: float = 0.0
    policy_seconds: float = 0.0
    learned: bool = False
    notes: tuple[str, ...] = ()
    tried: Rollout | None = None

    def __post_init__(self) -> None:
        """Take the predicted spread where nothing else is known of the deviations."""
        if not self.predicted_deviations.size and self.predicted_covariances.ndim == 3:
            variances = np.diagonal(self.predicted_covariances, axis1=1, axis2=2)
            deviations = np.sqrt(np.maximum(variances, 0.0))
            object.__setattr__(self, "predicted_deviations", deviations)

    @property
    def trial(self) -> Rollout:
        """The trial of the policy.

        Raises:
            InvalidSettingError: it has not been made.
        """
        if self.tried is None:
            raise InvalidSettingError(f"the policy of iteration {self.index} was not tried yet")
        return self.tried

    def to_arrays(self) -> dict[str, Array]:
        """Return everything but the trial as named arrays for an npz file without pickles."""
        names = (*_ARRAYS, *_DEVIATIONS, *_NUMBERS, *_COUNTS)
        arrays = {name: np.asarray(getattr(self, name)) for name in names}
        for name in _HYPERPARAMETERS:
            arrays[name] = getattr(self.hyperparameters, name)
        for name in _FURTHER:
            if (scale := getattr(self.hyperparameters, name)) is not None:
                arrays[name] = scale
        arrays["learned"] = np.asarray(self.learned)
        arrays["notes"] = np.asarray(self.notes, dtype=np.str_)
        for name, value in self.policy.to_arrays().items():
            arrays[f"policy_{name}"] = np.asarray(value)
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Any]) -> Iteration:
        """Return the iteration from what `to_arrays` made, for example an open npz file.

        Raises:
            InvalidSettingError: if an array is missing, has another shape or is not finite, or the
                policy in it is not sound.
        """
        try:
            policy = {
                name.removeprefix("policy_"): np.asarray(arrays[name])
                for name in arrays
                if name.startswith("policy_") and name != "policy_seconds"
            }
            told = _DEVIATIONS if "predicted_deviations" in arrays else {}
            fields: dict[str, Any] = _checked(arrays, _ARRAYS | told)
            kernel = _HYPERPARAMETERS | {
                name: shape for name, shape in _FURTHER.items() if name in arrays
            }
            fields["hyperparameters"] = Hyperparameters(**_checked(arrays, kernel))
            fields |= {name: float(arrays[name]) for name in _NUMBERS}
            fields |= {name: int(arrays[name]) for name in _COUNTS}
            learned = bool(arrays["learned"])
            notes = tuple(str(note) for note in arrays["notes"])
        except KeyError as error:
            raise InvalidSettingError(
                f"an iteration needs the array {error}; it is missing"
            ) from error
        if fields["index"] < 0:
            raise InvalidSettingError(
                f"an iteration's index is {fields['index']}; expected 0 or more"
            )
        return cls(policy=from_arrays(policy), learned=learned, notes=notes, **fields)


def _checked(arrays: Mapping[str, Any], shapes: Mapping[str, str]) -> dict[str, Array]:
    """Return the arrays by their names if they are finite numbers of these shapes, or all empty."""
    found = {name: np.asarray(arrays[name]) for name in shapes}
    sizes: dict[str, int] = {}
    for name, letters in shapes.items():
        array, wanted = found[name], letters.split()
        if array.dtype.kind not in "fiu" or not np.isfinite(array).all():
            raise InvalidSettingError(f"an iteration's {name} holds what is no finite number")
        if not any(each.size for each in found.values()):
            continue
        known = [sizes.setdefault(*pair) for pair in zip(wanted, array.shape, strict=False)]
        if len(wanted) != array.ndim or known != list(array.shape):
            raise InvalidSettingError(
                f"an iteration's {name} has shape {array.shape}; expected ({', '.join(wanted)})"
                + "".join(f", {letter} = {size}" for letter, size in sizes.items())
            )
    return found
