"""What a bag holds, as arrays: joint states with their stamps, and the commands they were given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irlpilco_ros.experience.errors import BagError, IncompleteTrialError
from irlpilco_ros.experience.motion import unwrapped
from irlpilco_ros.experience.resampling import measured_velocities
from irlpilco_ros.experience.smoothing import smoothed_states
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.rollout import Rollout

# A gap between two samples is called missing samples from this many cadences on: ticks fall on
# joint states, so that two samples are never exactly one control period apart.
GAP = 1.5

PACE = 0.1
"""Part of the control period by which the median time between decisions may differ from it."""


@dataclass(frozen=True)
class Trajectory:
    """Samples of one demonstration or trial, in the order of their stamps.

    Attributes:
        joint_names: names of the J joints.
        stamps: header stamp of every sample's joint state, shape (T,), rising [s].
        positions: joint positions, shape (T, J) [rad]; NaN where a command was recorded whose
            joint state was not.
        velocities: joint velocities, shape (T, J) [rad/s]; NaN as for positions.
        commands: commands decided on these states, shape (T, J) [rad/s], or [N m] for a robot
            that is commanded by effort; NaN where there was none.
    """

    joint_names: tuple[str, ...]
    stamps: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    commands: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "joint_names", tuple(self.joint_names))
        object.__setattr__(self, "stamps", np.asarray(self.stamps, dtype=float))
        shape = (len(self.stamps), len(self.joint_names))
        for name in ("positions", "velocities", "commands"):
            value = np.asarray(getattr(self, name), dtype=float)
            object.__setattr__(self, name, value)
            if value.shape != shape:
                raise BagError(
                    f"the {name} of a trajectory have shape {value.shape}; expected {shape} for "
                    f"{shape[0]} stamps and {shape[1]} joints"
                )
        if (np.diff(self.stamps) <= 0.0).any():
            raise BagError("the stamps of a trajectory must rise from sample to sample")

    def __len__(self) -> int:
        """Number of samples T."""
        return len(self.stamps)

    @property
    def commanded(self) -> np.ndarray:
        """Which samples bear a command, shape (T,), bool."""
        return np.asarray(~np.isnan(self.commands).all(axis=1))

    @property
    def observed(self) -> np.ndarray:
        """Which samples bear a joint state, shape (T,), bool."""
        return np.asarray(~np.isnan(self.positions).any(axis=1))

    @property
    def cadence(self) -> float:
        """Median time between samples [s]; NaN for fewer than two samples."""
        return float(np.median(np.diff(self.stamps))) if len(self) > 1 else float("nan")

    @property
    def missing(self) -> int:
        """Number of samples that are not there: commands without a state, and gaps in time."""
        return int((~self.observed).sum()) + missing_in(self.stamps)

    def columns(self, joints: Sequence[str]) -> list[int]:
        """Return the column of each of `joints`.

        Raises:
            BagError: names the joints that were not recorded, and those that were.
        """
        absent = [joint for joint in joints if joint not in self.joint_names]
        if absent:
            raise BagError(
                f"not recorded: {', '.join(absent)}; recorded joints: {', '.join(self.joint_names)}"
            )
        return [self.joint_names.index(joint) for joint in joints]

    def rollout(self, joints: Joints, horizon: int | None = None) -> Rollout:
        """Return the trial, or what is there if there are no commands, sample by sample.

        A trial is all samples with commands; samples without one that lie between them are left
        out. Its last command is the zero that the controller sends on x[H]; it is not a control.
        Without commands it begins with the first sample, and what comes after `horizon` steps is
        left out: a demonstration is brought to the control period by `shown_motion` first.
        Velocities that were not recorded are computed from the positions, and joints that turn
        without end do not wrap.

        Args:
            joints: Joints of the learning problem, in its order (J), F of them commanded.
            horizon: Number of control periods H that are expected; None takes what is there.

        Returns:
            States (H + 1, 2J) = [positions, velocities] and controls (H, F), all NaN without
            commands.

        Raises:
            BagError: a joint was not recorded.
            IncompleteTrialError: samples are missing, or the trial broke off; says where.
        """
        columns, controls = self.columns(joints.names), self.columns(joints.commanded)
        samples = np.flatnonzero(self.commanded)
        is_trial = len(samples) > 0
        if not is_trial:
            samples = self._demonstration(horizon)
        stamps, positions = self.stamps[samples], self.positions[samples][:, columns]
        _check_whole(stamps, positions)
        if is_trial:
            self._check_trial(samples, controls, horizon)
        positions = unwrapped(positions, joints.names, joints.continuous)
        velocities = self.velocities[samples][:, columns]
        absent = ~np.isfinite(velocities)
        if absent.any():
            velocities = np.where(absent, measured_velocities(stamps, positions), velocities)
        return Rollout(np.hstack([positions, velocities]), self.commands[samples][:-1, controls])

    def trial(
        self,
        joints: Joints,
        horizon: int | None = None,
        period: float | None = None,
        smooth: bool = False,
    ) -> Rollout:
        """Return the trial of a robot with this control period [s]; None takes any.

        Args:
            joints: As in `rollout`, like what follows.
            horizon: Number of control periods that are expected; None takes what is there.
            period: Control period [s].
            smooth: Whether states come from all that was recorded around the ticks, where that is
                dense enough, instead of from the one state that the policy saw.

        Raises:
            BagError: as `rollout`.
            IncompleteTrialError: as `rollout`, or nobody commanded the robot, or it was commanded
                at another pace.
        """
        self.columns(joints.names)
        decided = self.stamps[self.commanded]
        if not len(decided):
            raise IncompleteTrialError("no command was recorded: it is no trial")
        usual = _pace(decided)
        if usual and period and abs(usual - period) > PACE * period:
            raise IncompleteTrialError(
                f"its commands were decided every {usual:.3f} s; the robot's control_period is "
                f"{period:g} s: it is no trial of this robot"
            )
        rollout = self.rollout(joints, horizon)
        return self._smoothed(rollout, decided, joints) if smooth else rollout

    def _smoothed(self, rollout: Rollout, ticks: np.ndarray, joints: Joints) -> Rollout:
        """Return a rollout with states from all that was recorded around its ticks."""
        columns, told = self.columns(joints.names), self.observed
        positions = unwrapped(self.positions[told][:, columns], joints.names, joints.continuous)
        velocities = self.velocities[told][:, columns]
        if not np.isfinite(velocities).all():
            return rollout
        states = smoothed_states(self.stamps[told], positions, velocities, ticks)
        states = np.where(np.isfinite(states), states, rollout.states)
        angles = [joints.names.index(name) for name in joints.continuous]
        turns = np.rint((rollout.states - states)[:, angles] / (2.0 * np.pi))
        states[:, angles] += 2.0 * np.pi * turns
        return Rollout(states, rollout.controls)

    def _check_trial(self, samples: np.ndarray, controls: list[int], horizon: int | None) -> None:
        """Check that a trial has its end and its length."""
        steps, end = len(samples) - 1, self.stamps[samples[-1]]
        expected = "" if horizon is None else f" of {horizon}"
        if np.any(self.commands[samples[-1], controls] != 0.0):
            raise IncompleteTrialError(
                f"the trial broke off after {steps + 1}{expected} commands, at stamp {end:.3f} s: "
                "the zero command that ends a trial is not there"
            )
        if steps < 1 or (horizon is not None and steps != horizon):
            raise IncompleteTrialError(
                f"the trial has {steps}{expected} control periods; it ended at stamp {end:.3f} s"
            )

    def _demonstration(self, horizon: int | None) -> np.ndarray:
        """Return the samples of the demonstration."""
        needed = 2 if horizon is None else horizon + 1
        if len(self) < needed:
            raise IncompleteTrialError(
                f"the demonstration has {len(self)} samples; expected at least {needed}: one per "
                "control period and the last state"
            )
        return np.arange(len(self) if horizon is None else needed)


def _pace(stamps: np.ndarray) -> float | None:
    """Return the usual time between samples [s]; None if two intervals are not there.

    The last one does not count: what ends a trial may be a stop at any time.
    """
    intervals = np.diff(stamps)[:-1]
    return float(np.median(intervals)) if len(intervals) else None


def missing_in(stamps: np.ndarray) -> int:
    """Return how many samples the gaps between stamps [s], shape (T,), could have held."""
    usual = _pace(stamps)
    if usual is None:
        return 0
    multiples = np.diff(stamps) / usual
    return int((np.rint(multiples[multiples > GAP]) - 1).clip(min=1).sum())


def _check_whole(stamps: np.ndarray, positions: np.ndarray) -> None:
    """Check that no sample is missing between the first and the last."""
    blank = np.flatnonzero(~np.isfinite(positions).all(axis=1))
    if len(blank):
        raise IncompleteTrialError(
            f"sample {blank[0]} at stamp {stamps[blank[0]]:.3f} s has a command but no joint state"
        )
    missing = missing_in(stamps)
    if missing:
        intervals = np.diff(stamps)
        gap = int(np.argmax(intervals))
        raise IncompleteTrialError(
            f"{missing} {'sample is' if missing == 1 else 'samples are'} missing, or this is more "
            f"than one trial: {intervals[gap]:.3f} s pass after sample {gap} at stamp "
            f"{stamps[gap]:.3f} s, where {_pace(stamps):.3f} s are usual: was the "
            "recorder's computer, or the network, busy?"
        )
