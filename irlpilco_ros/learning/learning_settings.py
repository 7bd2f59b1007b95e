"""Every choice of the learning algorithm, with the defaults that work best."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from irlpilco_ros.learning import imitation as imitations
from irlpilco_ros.learning import policies
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.registry import Extension
from irlpilco_ros.learning.settings import check, extension_settings, options_of, setting


def _extensions() -> list[type[Extension]]:
    return [*imitations.REGISTRY.classes(), *policies.REGISTRY.classes()]


@dataclass(frozen=True)
class LearningSettings:
    """How to learn from a demonstration; the field names are the ROS parameters and YAML keys.

    Settings of extensions are in `options`, named `<extension>.<setting>`, and ROS parameters of
    just these names: `LearningSettings(policy="rbf", options={"rbf.count": 25})`.
    """

    imitation: str = setting(
        "feature_matching",
        "What the robot imitates. feature_matching: the features at every step; "
        "feature_expectations: only their sum over the trial; trajectory_kl: their distribution "
        "over several demonstrations (choose optimiser: lbfgs with it).",
        choices=imitations.REGISTRY.names,
    )
    prior_mean: str = setting(
        "velocity",
        "What the dynamics model expects before it has data. velocity: joints move at the "
        "commanded velocity; identified: nearly so, each joint with gains and a lag of its own "
        "that the trials tell; zero: nothing moves (thesis; needed for effort control).",
        choices=("velocity", "identified", "zero"),
    )
    command_history: int = setting(
        0,
        "How many of its last commands the state of the robot holds beside positions and "
        "velocities, for a robot that lags: about its delay divided by the control period; -1: as "
        "many as the first trial shows to be worth it.",
        minimum=-1,
        maximum=100,
    )
    sensor_noise: bool = setting(
        False,
        "Whether predictions count the noise of the measurements that the policy acts on: gains "
        "stay small, and predicted bands hold what they promise.",
    )
    repeating_errors: bool = setting(
        False,
        "Whether the dynamics model also learns what happens at the same time of every trial, "
        "whatever the state is, as iterative learning control does.",
    )
    infer_commands: bool = setting(
        False,
        "Whether the dynamics model also learns from the demonstrations, whose commands it infers "
        "where the trials tell them. For demonstrations that the robot's own dynamics allow, such "
        "as a swing-up that somebody else steered; not for arms that were led by hand.",
    )
    model_points: int = setting(
        300,
        "Largest number of points that the dynamics model consists of; of more recorded ones a "
        "sparse model is made. Fewer compute faster, with the square of their number.",
        minimum=10,
        maximum=2000,
    )
    hyperprior: str = setting(
        "dimension_scaled",
        "What is expected of the dynamics model's length-scales. dimension_scaled: that they grow "
        "with the number of inputs, for arms with many joints and few trials; pilco: only that "
        "they are not extreme, as in the PILCO software.",
        choices=("dimension_scaled", "pilco"),
    )
    covariance_approximation: str = setting(
        "first_order",
        "How an uncertain state is predicted. first_order: by moment matching, covariances between "
        "outputs to first order; exact: those exactly, several times slower; linearised: the model "
        "is taken for linear about the mean, several times faster, for motions that a robot "
        "repeats closely.",
        choices=("first_order", "exact", "linearised"),
    )
    policy: str = setting(
        "linear_phase",
        "Kind of policy: linear with feed-forward over the trial, linear (thesis), RBF, or one of "
        "another package.",
        choices=policies.searchable,
    )
    initial_policy: str = setting(
        "demonstration",
        "What the robot does in the first trial. demonstration: it follows the demonstration's "
        "own speeds; zero: it stands still; random: a policy with random parameters (thesis); "
        "random_controls: random commands (PILCO). The last two move the robot wildly.",
        choices=("demonstration", "zero", "random", "random_controls"),
    )
    initial_scale: float = setting(
        1.0,
        "Standard deviation of the parameters of a random policy, as the first one or as a start: "
        "1 drives most joints at their largest speed (thesis), a tenth or a hundredth does not "
        "(PILCO).",
        minimum=0.0,
        maximum=100.0,
    )
    optimiser: str = setting(
        "gauss_newton",
        "How policies are improved: Gauss-Newton with damping (fewest evaluations), BFGS (as "
        "PILCO), L-BFGS (thesis), or L-BFGS of parameters scaled by what they do to the controls, "
        "which linear policies of many joints need.",
        choices=("gauss_newton", "bfgs", "lbfgs", "scaled_lbfgs"),
    )
    evaluations: int = setting(
        12,
        "Largest number of times that one policy search predicts a trial. More take longer and "
        "may find a better policy.",
        minimum=1,
        maximum=100000,
    )
    starts: tuple[str, ...] = setting(
        ("last", "zero"),
        "Policies that a search may start from; it goes on from the best of them. last: that of "
        "the trial before; zero: no motion; initial: that of the first trial; random: random "
        "parameters; inverse: the commands by which the dynamics model explains the demonstration.",
        choices=("last", "zero", "initial", "random", "inverse"),
    )
    screening_evaluations: int = setting(
        4,
        "How many evaluations each of the starts is improved for before the best of them goes on; "
        "0: the one that costs least goes on at once.",
        minimum=0,
        maximum=100000,
    )
    horizon_stages: int = setting(
        1,
        "In how many steps policy search extends its horizon from the beginning of the trial to "
        "all of it, going further only where the prediction follows the demonstration; 1: the "
        "whole trial at once. For ways of imitating step by step.",
        minimum=1,
        maximum=1000,
    )
    start_widening: float = setting(
        1.0,
        "Factor on the spread of trials' starts in policy search: above 1, policies also answer "
        "starts that are rare. What is predicted of a policy is for the starts as they are.",
        minimum=1.0,
        maximum=10.0,
    )
    discount: float = setting(
        1.0,
        "How much each step of a trial counts relative to the step before (gamma). 1: all alike; "
        "smaller: the beginning is imitated better than the end.",
        minimum=0.01,
        maximum=1.0,
    )
    weight_rule: str = setting(
        "max_margin",
        "How much each feature counts, from the trials so far. max_margin and projection: most "
        "where all trials were off; max_margin_spread: where they were off by more than several "
        "demonstrations differ among themselves; latest: most where the last one was (thesis); "
        "uniform: all the same.",
        choices=("max_margin", "max_margin_spread", "projection", "latest", "uniform"),
    )
    weight_floor: float = setting(
        0.1,
        "Smallest weight of a feature relative to the largest. 0 lets learning neglect what the "
        "trials so far did well.",
        minimum=0.0,
        maximum=1.0,
    )
    margin_tolerance: float = setting(
        0.0,
        "The task counts as learned when the margin, the weighted squared deviation of the best "
        "mixture of trials, is at most this (epsilon).",
        minimum=0.0,
    )
    velocity_limit_factor: float = setting(
        3.0,
        "How many times as fast as in the demonstration a policy may move each joint, within "
        "velocity_limit. Larger leaves more room to catch up; near 1 a robot that lags cannot.",
        minimum=1.0,
        maximum=100.0,
    )
    velocity_limit_floor: float = setting(
        0.1,
        "Speed that a policy may use in any case within velocity_limit, even of joints that stood "
        "still in the demonstration.",
        unit="rad/s",
        minimum=0.0,
        maximum=100.0,
    )
    seed: int = setting(
        0, "Seed of random policies and controls: the same seed gives the same.", minimum=0
    )
    threads: int = setting(
        2,
        "Threads that learning computes with. It has work for two; results do not depend on it.",
        minimum=1,
        maximum=2,
    )
    options: Mapping[str, Any] = extension_settings(_extensions)

    def __post_init__(self) -> None:
        check(self)
        if self.infer_commands and (self.command_history or self.repeating_errors):
            raise InvalidSettingError(
                "infer_commands is true, which cannot be together with command_history or "
                "repeating_errors: what was commanded before, and what repeats in trials, is not "
                "known of a demonstration; set command_history: 0 and repeating_errors: false"
            )

    def options_of(self, extension: type[Extension]) -> Any:
        """Return the `Settings` of an extension, such as a kind of policy or a way of imitating."""
        return options_of(self.options, extension)
