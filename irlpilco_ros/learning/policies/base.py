"""What a policy is: arrays that it declares once, and its control at a Gaussian state.

Everything else about the arrays (checks, the parameter vector of policy search, ROS parameters, the
policy file, the documentation) follows from their declaration.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.moments.gaussian import Gaussian, Moments, ParameterPullback
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies.declaration import Declared, declared, with_shape
from irlpilco_ros.learning.registry import Extension, Registry
from irlpilco_ros.learning.task import Task

Arrays = dict[str, Array | float | int | str]
"""A policy as its `kind` and named arrays and numbers: what files and ROS parameters hold."""

SMALL = 0.1
"""Standard deviation of the parameters that PILCO's first search starts from."""


class Policy(Extension, ABC):
    """A map from state and step to controls, for a robot and for a Gaussian state alike.

    A policy is a frozen dataclass whose fields are made with `parameter`, `fixed` and `number` of
    this package. It has a field `control_limit` of shape "F", and its arrays tell D, or it has a
    field `state_size`.

    Attributes:
        control_limit: Largest absolute value of each control, shape (F,).
        state_size: Number of state dimensions D that the policy sees.
        searchable: Whether policy search can improve it, so that it may be learned.
        blend: Part of each control period over which a decision is blended in; 0 holds it.
    """

    searchable: ClassVar[bool] = True
    blend: float = 0.0
    control_limit: Array
    state_size: int

    def __post_init__(self) -> None:
        """Check every field; subclasses with more to check do so after this.

        Raises:
            InvalidSettingError: names the field, and what was expected.
        """
        sizes: dict[str, int] = {}
        for field in declared(type(self)):
            value = field.checked(self.kind, getattr(self, field.name), sizes)
            object.__setattr__(self, field.name, value)
        if "D" in sizes:
            object.__setattr__(self, "state_size", sizes["D"])

    @classmethod
    @abstractmethod
    def zero(cls, task: Task, control_limit: Array, settings: Any) -> Self:
        """Return the policy that does nothing, of the size that the task needs.

        Args:
            task: What is to be learned.
            control_limit: Largest absolute value of each control, shape (F,).
            settings: An instance of `cls.Settings`.
        """

    @classmethod
    def random_start(
        cls, task: Task, start: Gaussian, settings: Any, rng: np.random.Generator
    ) -> Self:
        """Return what classical PILCO's first search starts from: small random parameters.

        Args:
            task: What is to be learned.
            start: What the policy sees where its parts are to lie, such as at the start of a trial.
            settings: An instance of `cls.Settings`.
            rng: Source of the numbers.
        """
        zero = cls.zero(task, task.control_limit, settings)
        return zero.with_parameters(SMALL * rng.standard_normal(zero.parameters.shape))

    def fit(self, steps: Array, states: Array, controls: Array) -> Self | None:
        """Return the policy that gives controls before squashing (n, F), nearly.

        Args:
            steps: Of the trial, whole numbers, shape (n,).
            states: What the policy sees, shape (n, D).
            controls: Wanted before squashing, shape (n, F).

        Returns:
            None if this kind of policy cannot be fitted.
        """
        return None

    def fit_demonstration(self, states: Array, controls: Array) -> Self | None:
        """Return the policy for the first trial: arguments as `fit`, one row for each step."""
        return self.fit(np.arange(float(len(states))), states, controls)

    def along(self, states: Array, controls: Array, control_limit: Array) -> Self | None:
        """Return the policy with the same gains that gives other controls along other states.

        Args:
            states: What the policy sees, one row for each step of the trials now, shape (H, D).
            controls: Wanted before squashing, shape (H, F).
            control_limit: Largest absolute value of each control now, shape (F,).

        Returns:
            None if this kind of policy has no gains that could be kept.
        """
        return None

    @property
    def parameters(self) -> Array:
        """What policy search changes, as one vector (p,): arrays as declared, row by row."""
        return np.concatenate([getattr(self, each.name).ravel() for each in self._searched()])

    def with_parameters(self, parameters: Array) -> Self:
        """Return the policy with other parameters, laid out as in `parameters`.

        Raises:
            InvalidSettingError: if their number is wrong.
        """
        vector = np.asarray(parameters, dtype=float)
        shapes = {each.name: getattr(self, each.name).shape for each in self._searched()}
        ends = np.cumsum([int(np.prod(shape)) for shape in shapes.values()])
        if vector.shape != (ends[-1],):
            raise InvalidSettingError(
                f"a {self.kind} policy of this size has {ends[-1]} parameters; got an array of "
                f"shape {vector.shape}"
            )
        parts = np.split(vector, ends[:-1])
        changes = {
            name: part.reshape(shape)
            for (name, shape), part in zip(shapes.items(), parts, strict=True)
        }
        return dataclasses.replace(self, **changes)  # type: ignore[type-var]

    def act(self, state: Array, step: int) -> Array:
        """Return the control (F,) for a state (D,) at a step of the trial, within the limit."""
        moments, _ = self.moments(Gaussian(state, np.zeros((len(state),) * 2)), step, False)
        return moments.mean

    def between(self, time: float) -> Array:
        """Return the part of the control (F,) that depends on time alone, between the ticks too.

        Args:
            time: Since the trial's start, in control periods.
        """
        return np.zeros(len(self.control_limit))

    @abstractmethod
    def moments(
        self, state: Gaussian, step: int, gradient: bool = True
    ) -> tuple[Moments, ParameterPullback | None]:
        """Return the control's moments at a Gaussian state, and their pullback if asked for."""

    def mean_sensitivity(self, state: Gaussian, step: int) -> Array:
        """Return d (mean control) / d parameters at a Gaussian state, shape (F, p).

        Used for Gauss-Newton curvature only: the influence of the parameters on the mean by way
        of the control's spread may be left out.
        """
        moments, pullback = self.moments(state, step)
        assert pullback is not None
        nothing = np.zeros_like(moments.covariance), np.zeros_like(moments.jacobian)
        return np.stack([pullback(row, *nothing)[2] for row in np.eye(len(moments.mean))])

    def spread_curvature(
        self, states: Sequence[Gaussian], steps: Sequence[int], cost_weights: Array
    ) -> Array | None:
        """Return the Hessian by the parameters (p, p) of what the controls' spread costs.

        That is sum_t tr(cost_weights[t] cov u[t]), as far as gains go.

        Args:
            states: What the policy sees at each of T steps.
            steps: Their numbers in the trial.
            cost_weights: What spread of the controls costs, positive semidefinite, (T, F, F).

        Returns:
            A positive semidefinite matrix, or None if this kind of policy does not know it.
        """
        return None

    def change_metric(self, states: Sequence[Gaussian], steps: Sequence[int]) -> Array | None:
        """Return G (p, p) with d'G d = sum_t E |change of the control before squashing|^2.

        The change is that of the parameters by d, the states Gaussian; arguments as
        `spread_curvature`. None if this kind of policy does not know it; policy search then takes
        all parameters to matter alike.
        """
        return None

    def to_arrays(self) -> Arrays:
        """Return everything that `policies.from_arrays` needs to make this policy again."""
        fields = {each.name: getattr(self, each.name) for each in declared(type(self))}
        return {"kind": self.kind, **fields}

    @classmethod
    def from_lists(cls, values: Mapping[str, Any], sizes: Mapping[str, int]) -> Self:
        """Return the policy whose arrays are flat lists, as in ROS parameters.

        Args:
            values: By the names of the fields; numbers are as they are.
            sizes: The numbers of controls F and of state dimensions D.

        Raises:
            InvalidSettingError: missing or unknown names, wrong lengths or types, not finite.
        """
        check_names(cls, values)
        known = dict(sizes)
        shaped = {each.name: with_shape(each, values[each.name], known) for each in declared(cls)}
        return cls(**shaped)

    @classmethod
    def check_class(cls) -> None:
        """Check that the class declares what every policy has.

        Raises:
            InvalidSettingError: says what is missing.
        """
        fields = declared(cls)
        names = {each.name for each in fields}
        if "control_limit" not in names:
            raise InvalidSettingError(
                f"{cls.__qualname__} has no control_limit; declare it: "
                "control_limit: Array = control_limit()"
            )
        if "state_size" not in names and not any("D" in each.shape for each in fields):
            raise InvalidSettingError(
                f"no array of {cls.__qualname__} has a size D, so that the number of states is "
                "unknown; declare it: state_size: int = number(...)"
            )

    def _searched(self) -> list[Declared]:
        return [each for each in declared(type(self)) if each.searched]


def check_names(cls: type[Policy], values: Mapping[str, Any]) -> None:
    """Refuse values that are not those of the fields of a kind of policy.

    Raises:
        InvalidSettingError: names what is missing and what is unknown.
    """
    wanted = {each.name for each in declared(cls)}
    if set(values) != wanted:
        missing, unknown = sorted(wanted - set(values)), sorted(set(values) - wanted)
        raise InvalidSettingError(
            f"a {cls.kind} policy needs {', '.join(sorted(wanted))}; "
            f"missing: {', '.join(missing) or 'none'}; unknown: {', '.join(unknown) or 'none'}"
        )


REGISTRY: Registry[Policy] = Registry("irlpilco_ros.policies", Policy)  # type: ignore[type-abstract]
"""The kinds of policies."""
