"""The joints of a robot, and which of them are unactuated or continuous."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.state_layout import StateLayout


class SizedPolicy(Protocol):
    """A policy, as far as a robot's joints need it."""

    @property
    def state_size(self) -> int:
        """How many numbers of the state it sees."""

    @property
    def control_limit(self) -> Array:
        """Largest absolute value of each control, shape (F,)."""

    @property
    def blend(self) -> float:
        """Part of each control period over which a decision is blended in."""

    def between(self, time: float) -> Array:
        """Return the part of the control (F,) that depends on time alone [control periods]."""

    def act(self, state: Array, step: int) -> Array:
        """Return the control (F,) for what a policy sees of the state, at a step of the trial."""


@dataclass(frozen=True)
class Joints:
    """J joints in the order of the state [positions, velocities].

    Attributes:
        names: All joints that the state tells of.
        unactuated: Those of them that nobody commands, such as a pole that swings freely.
        continuous: Those of them that turn without end: model, policy and features see the sine and
            cosine of their angle, never the angle itself.

    Raises:
        InvalidSettingError: a name is repeated or unknown, or no joint is commanded.
    """

    names: tuple[str, ...]
    unactuated: tuple[str, ...] = ()
    continuous: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for field in ("names", "unactuated", "continuous"):
            names = tuple(getattr(self, field))
            object.__setattr__(self, field, names)
            if len(set(names)) < len(names):
                raise InvalidSettingError(
                    f"the list {field} names a joint twice: {', '.join(names)}"
                )
            unknown = [name for name in names if name not in self.names]
            if unknown:
                raise InvalidSettingError(
                    f"{field} joints {', '.join(unknown)} are not among the robot's joints: "
                    f"{', '.join(self.names)}"
                )
        if self.names and not self.commanded:
            raise InvalidSettingError(
                f"all of the joints {', '.join(self.names)} are unactuated; a robot needs at least "
                "one that is commanded"
            )

    @property
    def commanded(self) -> tuple[str, ...]:
        """The F joints that are commanded, in the order of the controls."""
        return tuple(name for name in self.names if name not in self.unactuated)

    @property
    def commanded_columns(self) -> list[int]:
        """Where among all joints the commanded ones are, F indices."""
        return [self.names.index(name) for name in self.commanded]

    @cached_property
    def layout(self) -> StateLayout:
        """What model and policy see of the state, as in PILCO."""
        angles = tuple(self.names.index(name) for name in self.continuous)
        size = 2 * len(self.names)
        seen = tuple(i for i in range(size + 2 * len(angles)) if i not in angles)
        return StateLayout(size, angles, dynamics_inputs=seen, policy_inputs=seen)

    @property
    def policy_size(self) -> int:
        """How many numbers of the state a policy sees."""
        return len(self.layout.policy_inputs or ())


class PolicyOf:
    """A policy as the robot runs it in one trial: from what is measured of its joints.

    It remembers the last commands, if the policy's state holds them: have a new one for each trial.

    Attributes:
        joints: The robot's joints.
        policy: What the joints are moved by.
    """

    def __init__(self, joints: Joints, policy: SizedPolicy) -> None:
        """Begin at rest.

        Raises:
            InvalidSettingError: the policy's state is no whole number of commands larger than that
                of the joints.
        """
        self.joints = joints
        self.policy = policy
        controls = len(joints.commanded)
        history, rest = divmod(policy.state_size - joints.policy_size, controls)
        if rest or history < 0:
            raise InvalidSettingError(
                f"the policy sees {policy.state_size} numbers; the joints have {joints.policy_size}"
                f", and each remembered command {controls} more"
            )
        self._layout = joints.layout.remembering(controls, history)
        self._remembered = np.zeros(history * controls)

    @property
    def control_limit(self) -> Array:
        """Largest absolute value of each control, shape (F,)."""
        return self.policy.control_limit

    @property
    def blend(self) -> float:
        """Part of each control period over which a decision is blended in."""
        return self.policy.blend

    def between(self, time: float) -> Array:
        """Return the part of the control (F,) that depends on time alone [control periods]."""
        return self.policy.between(time)

    def view(self, state: Array) -> Array:
        """Return what the policy sees, for the measured state [q, q_dot] (2J,)."""
        return self._layout.policy_view(np.concatenate([state, self._remembered]))

    def act(self, state: Array, step: int) -> Array:
        """Return the control (F,) for the state [q, q_dot] (2J,) at a step of the trial."""
        control = self.policy.act(self.view(state), step)
        if self._remembered.size:
            self._remembered = np.concatenate([control, self._remembered[: -len(control)]])
        return control
