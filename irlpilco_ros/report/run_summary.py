"""What a run has shown, as plain arrays: all that the figures and the page need to know."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.experience.path_quality import UNKNOWN, MotionPath, PathQuality
from irlpilco_ros.report.joint_use import JointUse

FloatArray = NDArray[np.float64]

UNKNOWN_UNIT = "rad or m"
"""Unit of a joint of which nobody knows whether it turns or slides."""


def all_of(units: Collection[str]) -> str:
    """Return the unit of what is told of joints of these units together, such as "rad and m"."""
    return " and ".join(sorted(set(units), reverse=True))


@dataclass(frozen=True)
class IterationSummary:
    """One iteration and its trial.

    Iteration k was computed from the trials 0..k-1, and its prediction is one of trial k.
    Iteration 0 is the initial trial: it has no prediction and no computing time.

    Attributes:
        index: k.
        trial: what the robot did, joint positions of shape (H+1, J) [rad].
        prediction: mean of the predicted positions, shape (H+1, J) [rad], or None.
        deviation: standard deviation of the predicted positions, shape (H+1, J) [rad], or None.
        weights: cost weights that the policy was computed with, one per feature, or None.
        rmse: root-mean-square joint error of the trial against the demonstration [rad].
        mse: the thesis's error (6.1).
        margin: margin of the weight rule, NaN if there is none.
        cost: value of the minimised objective J, NaN if there is none.
        robot_time: robot seconds used so far, this trial included [s].
        model_time: seconds of computing spent on the dynamics model [s].
        policy_time: seconds of computing spent on the policy search [s].
        notes: what a reader should know of the computing.
        path: how the trial went between the decisions.
    """

    index: int
    trial: FloatArray
    prediction: FloatArray | None
    deviation: FloatArray | None
    weights: FloatArray | None
    rmse: float
    mse: float
    margin: float
    cost: float
    robot_time: float
    model_time: float
    policy_time: float
    notes: tuple[str, ...] = ()
    path: PathQuality = UNKNOWN


@dataclass(frozen=True)
class ModelSummary:
    """The latest dynamics model: which inputs matter for which output.

    Attributes:
        input_names: the P inputs, such as "left_s0 position".
        output_names: the E outputs, such as "left_s0 velocity".
        lengthscales: shape (E, P), in units of each input.
        input_spread: standard deviation of each input over the training set, shape (P,).
    """

    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    lengthscales: FloatArray
    input_spread: FloatArray

    @property
    def relevance(self) -> FloatArray:
        """Spread of the data in length-scales, shape (E, P): 1/length-scale without units."""
        return self.input_spread / self.lengthscales


@dataclass(frozen=True)
class RunSummary:
    """A whole run.

    Attributes:
        name: name of the run directory.
        joints: names of the J joints.
        times: time of every sample, 0 to H dt, shape (H+1,) [s].
        demonstration: joint positions of the demonstration, shape (H+1, J) [rad].
        iterations: in order, the initial trial first.
        replay: joint positions of the open-loop replay, shape (H+1, J) [rad], or None.
        replay_rmse: its error against the demonstration [rad], NaN if there is none.
        model: the latest dynamics model, or None before the first iteration.
        settings: the run's configuration, key to printed value.
        continuous: those joints of which full turns do not count.
        features: names of the features that are weighted; empty where nobody knows them.
        units: of each joint's position and its errors, J of them; of a joint that may slide,
            `UNKNOWN_UNIT`. Empty: all radians.
        margin_unit: of the margin; "" where features of several units add up in it.
        demonstrations: how often the task was shown.
        commands: what the robot is commanded, "velocities" or "efforts".
        replay_path: how the replay went between the decisions.
        demonstration_path: the same of the demonstration.
        courses: the demonstration, the replay and the best trial between the decisions, by these
            names; those of which every joint state was recorded.
        best_command: what runs the policy of the best trial; "" if nobody knows.
        uses: what each joint used of its limits in the best trial; empty if nobody knows.
    """

    name: str
    joints: tuple[str, ...]
    times: FloatArray
    demonstration: FloatArray
    iterations: tuple[IterationSummary, ...]
    replay: FloatArray | None
    replay_rmse: float
    model: ModelSummary | None
    settings: dict[str, str]
    continuous: tuple[str, ...] = ()
    features: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    margin_unit: str = "rad²"
    demonstrations: int = 1
    commands: str = "velocities"
    best_command: str = ""
    replay_path: PathQuality = UNKNOWN
    demonstration_path: PathQuality = UNKNOWN
    courses: Mapping[str, MotionPath] = field(default_factory=dict)
    uses: tuple[JointUse, ...] = ()

    @property
    def unit(self) -> str:
        """Unit of what is told of all joints together: "rad", "m", "rad and m"."""
        return all_of(self.units) or "rad"

    @property
    def is_mixed(self) -> bool:
        """Whether some joints turn and others slide: then each has its unit beside it."""
        return len(set(self.units)) > 1

    def unit_of(self, joint: int) -> str:
        """Unit of one joint's position."""
        return self.units[joint] if self.units else "rad"

    def beside(self, joint: int) -> str:
        """What stands beside the name of a joint: its unit, where not all have the same."""
        return f" [{self.unit_of(joint)}]" if self.is_mixed else ""

    @property
    def path_is_known(self) -> bool:
        """Whether the best trial was recorded between the decisions, too."""
        return bool(np.isfinite(self.best.path.rmse))

    @property
    def last(self) -> IterationSummary:
        """The latest iteration whose trial is on disk."""
        return self.iterations[-1]

    @property
    def best(self) -> IterationSummary:
        """The iteration whose trial is the best, by error (6.1)."""
        judged = [each for each in self.iterations if np.isfinite(each.mse)]
        return min(judged, key=lambda each: each.mse, default=self.last)

    @property
    def feature_names(self) -> tuple[str, ...]:
        """Names of the weighted features; numbers where `features` does not know them."""
        counts = [len(i.weights) for i in self.iterations if i.weights is not None]
        if not counts or counts[0] == len(self.features):
            return self.features
        return tuple(f"feature {number}" for number in range(1, counts[0] + 1))

    @property
    def computing_time(self) -> float:
        """Seconds of computing over all iterations [s]."""
        return float(sum(i.model_time + i.policy_time for i in self.iterations))

    def predicted_rmse(self, iteration: IterationSummary) -> float:
        """Return the error that the model expected: sqrt of E[(q - demonstration)^2] [rad].

        NaN for an iteration without a prediction. The start is left out, as in the error (6.1).
        """
        if iteration.prediction is None or iteration.deviation is None:
            return float("nan")
        squares = self.difference(iteration.prediction) ** 2 + iteration.deviation**2
        return float(np.sqrt(squares[1:].mean()))

    def coverage(self, iteration: IterationSummary) -> float:
        """Return the share of a trial, 0..1, within two predicted standard deviations.

        NaN for an iteration without a prediction. The start is left out.
        """
        if iteration.prediction is None or iteration.deviation is None:
            return float("nan")
        off = np.abs(self._without_turns(iteration.trial - iteration.prediction))
        return float((off <= 2.0 * iteration.deviation)[1:].mean())

    def joint_rmse(self, iteration: IterationSummary) -> FloatArray:
        """Return the error of every joint in a trial, shape (J,) [rad]."""
        squares = self.difference(iteration.trial)[1:] ** 2
        return np.asarray(np.sqrt(squares.mean(axis=0)))

    def difference(self, positions: FloatArray) -> FloatArray:
        """Return positions (H+1, J) minus the demonstration's, without full turns [rad]."""
        return self._without_turns(positions - self.demonstration)

    def _without_turns(self, difference: FloatArray) -> FloatArray:
        columns = [self.joints.index(joint) for joint in self.continuous]
        nearest = difference.copy()
        nearest[:, columns] -= 2.0 * np.pi * np.round(difference[:, columns] / (2.0 * np.pi))
        return nearest


@dataclass(frozen=True)
class DebrisCount:
    """Debris in the pan after a sweep, over several scatterings of the debris.

    Attributes:
        seeds: seed of every scattering.
        pieces: how many pieces lay on the table.
        counts: for each way of sweeping, in order, the pieces in the pan by scattering: (n,).
    """

    seeds: tuple[int, ...]
    pieces: int
    counts: dict[str, NDArray[np.int64]]
