"""The learned dynamics: one GP per state dimension on the change of the state (2.17)."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.gp.hyperprior import HyperpriorName
from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.gp.linear_part import Identified, LinearPart, identify
from irlpilco_ros.learning.gp.posterior import Posterior, condition
from irlpilco_ros.learning.gp.repeated_part import RepeatedPart
from irlpilco_ros.learning.gp.sparse import condition_sparse, spread_points
from irlpilco_ros.learning.gp.training import maximise_evidence
from irlpilco_ros.learning.moments.coefficient_spread import widened
from irlpilco_ros.learning.moments.gaussian import Moments, Pullback
from irlpilco_ros.learning.moments.moment_matching import CovarianceApproximation, MomentMatching
from irlpilco_ros.learning.numerics.arrays import Array

MAX_EXACT_POINTS = 300
"""Points beyond which the model becomes sparse: about the thesis's 15 trials and some more."""

_LARGEST = 1e50  # squares of products of this still are numbers


@dataclass(frozen=True)
class DynamicsModel:
    """A GP model of the change of the state, given state and control.

    Attributes:
        inputs: Training inputs [state, control], of shape (n, P).
        targets: Training targets, the changes of the state, of shape (n, E).
        hyperparameters: Of the kernel, per output.
        prior_mean: A of the prior mean A x, of shape (E, P); zero for a zero mean.
        posterior: The GPs of what the prior mean leaves over, conditioned on the data.
        identified: The coefficients of a linear part, whose mean is in `prior_mean`; None without.
        notes: What had to be done to make the numbers sound, in words; empty if nothing.
        threads: How many threads a prediction may use; has no influence on the result.
    """

    inputs: Array
    targets: Array
    hyperparameters: Hyperparameters
    prior_mean: Array
    posterior: Posterior
    notes: tuple[str, ...] = ()
    threads: int = 1
    identified: Identified | None = None

    @staticmethod
    def train(
        inputs: Array,
        targets: Array,
        prior_mean: Array | None = None,
        warm_start: Hyperparameters | None = None,
        threads: int = 2,
        progress: Callable[[float], None] | None = None,
        max_evaluations: int = 300,
        max_exact_points: int = MAX_EXACT_POINTS,
        hyperprior: HyperpriorName = "pilco",
        linear: LinearPart | None = None,
        repeated: RepeatedPart | None = None,
        cold_search: bool = True,
    ) -> DynamicsModel:
        """Return the model of most evidence.

        Args:
            inputs: [state, control], of shape (n, P).
            targets: Changes of the state, of shape (n, E).
            prior_mean: A of the linear prior mean, of shape (E, P); None for a zero mean.
            warm_start: As `maximise_evidence`, like what follows.
            threads: How many threads may work, now and in predictions.
            progress: Told the fraction done.
            max_evaluations: Of the evidence, for each search.
            max_exact_points: With more points than this, the hyperparameters come from this many
                points, evenly spread over the data in their order, and the model is sparse: see
                `condition`.
            hyperprior: On the hyperparameters, before any data.
            linear: Part of the dynamics that is linear, with coefficients to be identified.
            repeated: To which step of its trial each point belongs, where what repeats there is
                to be identified.
            cold_search: As `maximise_evidence`.

        Raises:
            InvalidSettingError: if shapes disagree or the data are not finite.
            NumericalError: if no positive-definite kernel matrix can be found.
        """
        shape = (targets.shape[-1], inputs.shape[-1])
        prior = np.zeros(shape) if prior_mean is None else prior_mean
        residuals = _residuals(inputs, targets, prior)
        hyperparameters = maximise_evidence(
            inputs,
            residuals,
            hyperprior,
            warm_start,
            max_exact_points,
            max_evaluations,
            threads,
            progress,
            linear,
            repeated,
            cold_search,
        )
        return DynamicsModel.condition(
            inputs, targets, hyperparameters, prior, threads, max_exact_points, linear, repeated
        )

    @staticmethod
    def condition(
        inputs: Array,
        targets: Array,
        hyperparameters: Hyperparameters,
        prior_mean: Array | None = None,
        threads: int = 1,
        max_exact_points: int = MAX_EXACT_POINTS,
        linear: LinearPart | None = None,
        repeated: RepeatedPart | None = None,
    ) -> DynamicsModel:
        """Return the model for given hyperparameters: no search, one factorisation per output.

        Args:
            inputs: Of shape (n, P).
            targets: Of shape (n, E).
            hyperparameters: Of E outputs and P inputs.
            prior_mean: A, of shape (E, P); None for a zero mean.
            threads: How many threads may work, now and in predictions.
            max_exact_points: With more points than this the model is sparse (FITC), with this
                many inducing points chosen to cover the data, so that the cost of a prediction
                stops growing.
            linear: Part that is linear, for hyperparameters that have `log_linear`.
            repeated: What repeats, for hyperparameters that have `log_repeated`.

        Raises:
            InvalidSettingError: if shapes disagree or the data are not finite.
            NumericalError: if a kernel matrix is not positive definite whatever the jitter.
        """
        shape = hyperparameters.log_lengthscales.shape
        prior = np.zeros(shape) if prior_mean is None else prior_mean
        residuals = _residuals(inputs, targets, prior)
        identified = None
        if linear is not None or repeated is not None:
            some = np.linspace(0, len(inputs) - 1, min(len(inputs), max_exact_points)).astype(int)
            identified = identify(
                linear, repeated, inputs, residuals, some, hyperparameters, threads
            )
            prior = prior + identified.mean
            residuals = residuals - inputs @ identified.mean.T
            if repeated is not None:
                residuals = residuals - identified.repeated[repeated.steps]
        notes: tuple[str, ...] = ()
        if len(inputs) <= max_exact_points:
            posterior = condition(inputs, residuals, hyperparameters, threads)
        else:
            inducing = inputs[spread_points(inputs, max_exact_points)]
            posterior = condition_sparse(
                inputs, residuals, hyperparameters, inducing[None], threads=threads
            )
            notes = (f"sparse model: {len(inducing)} inducing points for {len(inputs)} points",)
        return DynamicsModel(
            inputs,
            targets,
            hyperparameters,
            prior,
            posterior,
            notes + posterior.notes,
            threads,
            identified,
        )

    def predict(
        self,
        mean: Array,
        covariance: Array,
        approximation: CovarianceApproximation = "first_order",
        gradient: bool = True,
        step: int | None = None,
    ) -> tuple[Moments, Pullback | None]:
        """Predict the change of the state for a Gaussian input N(mean, covariance).

        The covariance is the latent function's: no observation noise is added.

        Args:
            mean: Of state and control, of shape (P,).
            covariance: Of shape (P, P), positive semi-definite (it may be zero).
            approximation: How covariances between different outputs are found: "exact"
                (E (E - 1) / 2 more n x n blocks), "first_order" (V_a' S V_b), or "linearised", as
                that, with everything else to first order too.
            gradient: False saves the work for the pullback, which is None then.
            step: Of a trial, from 0, for what repeats there; None for no trial's.

        Returns:
            Moments with mean (E,), covariance (E, E), jacobian (E, P), and their pullback.

        Raises:
            NumericalError: if the input is not finite or its covariance is indefinite.
        """
        found = self._moment_matching.moments(mean, covariance, approximation, gradient)
        if self.identified is None:
            return found
        return widened(self.identified, *found, mean, covariance, step)

    def expecting(self, other: DynamicsModel) -> DynamicsModel:
        """Return a model that expects the linear part of another alone, and doubts it as this does.

        What the squared exponentials found in the data is no part of its mean; what they do not
        know is part of its variance.

        Args:
            other: Of the same data.
        """
        doubting = dataclasses.replace(
            self.posterior, weights=np.zeros_like(self.posterior.weights)
        )
        return dataclasses.replace(
            self, prior_mean=other.prior_mean, identified=other.identified, posterior=doubting
        )

    @cached_property
    def _moment_matching(self) -> MomentMatching:
        return MomentMatching(self.posterior, self.prior_mean, self.threads)


def _residuals(inputs: Array, targets: Array, prior_mean: Array) -> Array:
    """Return what the prior mean leaves over; refuse data that no model can be made of.

    Raises:
        InvalidSettingError: says which array has which shape, or where it is not finite.
    """
    if inputs.ndim != 2 or targets.ndim != 2 or len(inputs) != len(targets) or not len(inputs):
        raise InvalidSettingError(
            f"training inputs have shape {inputs.shape} and targets {targets.shape}; "
            "expected (n, P) and (n, E) with the same n of at least 1"
        )
    expected = (targets.shape[1], inputs.shape[1])
    if prior_mean.shape != expected:
        raise InvalidSettingError(f"prior_mean has shape {prior_mean.shape}; expected {expected}")
    for name, array in (("inputs", inputs), ("targets", targets)):
        wrong = ~(np.abs(array) <= _LARGEST)
        if np.any(wrong):
            row, column = np.argwhere(wrong)[0]
            raise InvalidSettingError(
                f"training {name} hold {array[row, column]} in row {row}, column {column}; "
                f"expected finite numbers up to {_LARGEST:g}: drop that sample"
            )
    return targets - inputs @ prior_mean.T
