"""Every choice of the learning algorithm, with the defaults that work best."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from irlpilco_ros.learning import policies
from irlpilco_ros.learning.registry import Extension
from irlpilco_ros.learning.settings import check, extension_settings, options_of, setting


@dataclass(frozen=True)
class LearningSettings:
    """How to learn from a demonstration; the field names are the ROS parameters and YAML keys.

    Settings of extensions are in `options`, named `<extension>.<setting>`, and ROS parameters of
    just these names: `LearningSettings(policy="rbf", options={"rbf.count": 25})`.
    """

    imitation: str = setting(
        "feature_matching",
        "What imitation means: features step by step, their discounted sum, or trajectory KL "
        "(which a wide prediction pleases: give it the lbfgs optimiser).",
        choices=("feature_matching", "feature_expectations", "trajectory_kl"),
    )
    prior_mean: str = setting(
        "velocity",
        "Mean of the dynamics before any data: a velocity-controlled robot, or nothing (thesis).",
        choices=("velocity", "zero"),
    )
    hyperprior: str = setting(
        "dimension_scaled",
        "Belief about the model's length-scales before any data: that they grow with the number "
        "of inputs, or only that they do not run away (as PILCO).",
        choices=("dimension_scaled", "pilco"),
    )
    covariance_approximation: str = setting(
        "first_order",
        "Covariance between the outputs of the dynamics model: to first order, or exact.",
        choices=("first_order", "exact"),
    )
    policy: str = setting(
        "linear_phase",
        "Kind of policy: linear with feed-forward over the trial, linear (thesis), RBF, or one of "
        "another package.",
        choices=policies.searchable,
    )
    initial_policy: str = setting(
        "demonstration",
        "First trial: fitted to the demonstration's own speeds, no motion, random parameters "
        "(thesis), or random controls (PILCO).",
        choices=("demonstration", "zero", "random", "random_controls"),
    )
    optimiser: str = setting(
        "gauss_newton",
        "Policy search: Gauss-Newton with damping, BFGS (PILCO), or L-BFGS (thesis).",
        choices=("gauss_newton", "bfgs", "lbfgs"),
    )
    evaluations: int = setting(
        12, "Largest number of cost evaluations of one policy search.", minimum=1, maximum=100000
    )
    starts: tuple[str, ...] = setting(
        ("last", "zero"),
        "Where policy search may start; it goes on from the best of them. inverse: the controls "
        "that the dynamics model takes the demonstration for.",
        choices=("last", "zero", "initial", "random", "inverse"),
    )
    screening_evaluations: int = setting(
        4,
        "Evaluations for which each start of comparable cost is tried out before the best goes "
        "on; 0: the start that costs least is improved.",
        minimum=0,
        maximum=100000,
    )
    horizon_stages: int = setting(
        1,
        "In how many stages the horizon of policy search grows, as far as the first of the starts "
        "can follow the demonstration, each with as many evaluations as screening; 1: at once. "
        "With feature_matching only.",
        minimum=1,
        maximum=1000,
    )
    variance_weight: float = setting(
        1.0,
        "How much predicted spread costs (lambda): 1 is the expected square, 0 the thesis.",
        minimum=0.0,
        maximum=1000.0,
    )
    discount: float = setting(
        1.0, "Weight of each step relative to the one before (gamma).", minimum=0.01, maximum=1.0
    )
    weight_rule: str = setting(
        "max_margin",
        "How cost weights follow from the trials so far.",
        choices=("max_margin", "projection", "latest", "uniform"),
    )
    weight_floor: float = setting(
        0.1,
        "Smallest cost weight relative to the largest, so that no feature is forgotten.",
        minimum=0.0,
        maximum=1.0,
    )
    margin_tolerance: float = setting(
        0.0, "The task counts as learned when the margin is at most this (epsilon).", minimum=0.0
    )
    velocity_limit_factor: float = setting(
        3.0,
        "Largest control of the policy, relative to the demonstration's largest speed.",
        minimum=1.0,
        maximum=100.0,
    )
    velocity_limit_floor: float = setting(
        0.1,
        "The policy's largest control is at least this, however still a joint was.",
        unit="rad/s",
        minimum=0.0,
        maximum=100.0,
    )
    seed: int = setting(0, "Seed of everything random in learning.", minimum=0)
    threads: int = setting(
        2, "Threads for the dynamics model; results do not depend on it.", minimum=1, maximum=256
    )
    options: Mapping[str, Any] = extension_settings(policies.REGISTRY.classes)

    def __post_init__(self) -> None:
        check(self)

    def options_of(self, extension: type[Extension]) -> Any:
        """Return the `Settings` of an extension, such as a kind of policy."""
        return options_of(self.options, extension)
