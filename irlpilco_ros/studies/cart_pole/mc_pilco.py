"""The cart-pole of MC-PILCO's published script, learned by this package's classical PILCO.

github.com/merlresearch/MC-PILCO, test_mcpilco_cartpole.py (F. Amadio et al., IEEE T-RO 2022):
m1 = m2 = 0.5 kg, l = 0.5 m, b = 0.1 N s/m, g = 9.81 m/s^2, |u| <= 10 N, a decision every 0.05 s,
trials of 3 s, starts at N(0, 1e-4 I), noise of 0.01 in every measured state, velocities included;
one trial of random controls, then five that are learned, all of them whether they succeed or not.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence

import numpy as np

from irlpilco_ros.learning import Iteration, LearningSettings, Rollout, Task, pilco
from irlpilco_ros.learning.costs import StateCost
from irlpilco_ros.learning.features import JointPositions
from irlpilco_ros.learning.joints import PolicyOf
from irlpilco_ros.learning.judgement import cost_of_trial
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.studies.cart_pole.either_side import either_side_loss
from irlpilco_ros.studies.cart_pole.runs import EXPERT_SETTINGS
from irlpilco_ros.studies.job import Job, Result
from sim_bridge.cart_pole_equations import CartPoleParameters
from sim_bridge.cart_pole_simulation import (
    CART_POLE_JOINTS,
    FORCE_LIMIT,
    PERIOD,
    CartPoleSettings,
    CartPoleSimulation,
)
from sim_bridge.episode import run_trial

EXPERIMENT = "mc_pilco"
CONTROL_PERIOD = 0.05  # [s]
HORIZON = 60  # decisions in a trial: 3 s
TRIALS = 5  # after the one of random controls
PARAMETERS = CartPoleParameters(gravity=9.81)
START_SPREAD = 0.01  # of each state [m, rad, m/s, rad/s]
REGION = np.array([0.6, np.pi, 1.7, 4.6])  # standard deviations of where states go in a swing-up
NOISE = 0.01  # of each measured state
TARGET = np.array([0.0, np.pi])  # of x [m] and |theta| [rad]
LENGTHS = np.array([1.0, 3.0])  # of the cost: 1 - exp(-sum(((x, |theta|) - target)^2 / length^2))

LAST_SECOND = 20  # steps: success is judged by it
POSITION_WITHIN = 0.1  # [m]
ANGLE_WITHIN = np.deg2rad(10.0)  # [rad] of |theta| from pi

SETTINGS = dataclasses.replace(EXPERT_SETTINGS, evaluations=100, sensor_noise=True, threads=1)
"""As the expert of `irlpilco cart-pole`, but that predictions count the noise that the policy
sees; on one thread, for the study runs processes."""


def jobs(seeds: Sequence[int]) -> list[Job]:
    """Return what is computed: one run for each seed."""
    return [_job(dataclasses.replace(SETTINGS, seed=seed)) for seed in seeds]


def _job(settings: LearningSettings) -> Job:
    arguments = {"settings": settings}
    return Job(EXPERIMENT, "classical_pilco", settings.seed, learn_swing_up, arguments)


def learn_swing_up(settings: LearningSettings) -> Result:
    """Learn by classical PILCO; return one row for each trial, the random one first.

    Args:
        settings: How; their seed is that of starts and noise, too.

    Returns:
        `rows`, each with `succeeded` by the true states and `succeeded_as_measured`, the largest
        `position` [m] and `angle` off upright [rad] of the last second, the `predicted` cost (None
        for the first trial) and what it was, and `cpu_seconds` of all computing so far.
    """
    robot, task = _Robot(settings.seed), swing_up_task()
    loop = pilco(task, settings, robot.run)
    began = time.process_time()
    rows = []
    for iteration in loop:
        rows.append(_row(task, iteration, robot.true_states, time.process_time() - began))
        if len(rows) > TRIALS:
            break
    return {"rows": rows}


def swing_up_task() -> Task:
    """Return what is to be learned, with the published script's cost."""
    return Task(
        (),
        CONTROL_PERIOD,
        np.array([FORCE_LIMIT]),
        layout=CART_POLE_JOINTS.layout,
        cost=StateCost(JointPositions(2), TARGET, np.diag(2.0 / LENGTHS**2), either_side_loss),
        start=Gaussian(np.zeros(4), START_SPREAD**2 * np.eye(4)),
        region=Gaussian(np.zeros(4), np.diag(REGION**2)),
        horizon=HORIZON,
        position_noise=NOISE,
        velocity_noise=NOISE,
    )


def succeeded(states: Array) -> bool:
    """Say whether |x| < 0.1 m and 170 deg < |theta| < 190 deg during all of the last second.

    Args:
        states: [x, theta, x_dot, theta_dot] at every tick, shape (H + 1, 4).
    """
    position, angle = _worst_of_last_second(states)
    return bool(position < POSITION_WITHIN and angle < ANGLE_WITHIN)


def _worst_of_last_second(states: Array) -> tuple[float, float]:
    """Return the largest |x| [m], and the largest distance of |theta| from pi [rad]."""
    last = np.abs(states[-LAST_SECOND - 1 :, :2])
    return float(last[:, 0].max()), float(np.abs(last[:, 1] - np.pi).max())


def _row(task: Task, iteration: Iteration, true_states: Array, cpu_seconds: float) -> Result:
    assert task.cost is not None
    position, angle = _worst_of_last_second(true_states)
    measured = Rollout(true_states, iteration.trial.controls)
    return {
        "succeeded": succeeded(true_states),
        "succeeded_as_measured": succeeded(iteration.trial.states),
        "position": position,
        "angle": angle,
        "predicted": iteration.cost if iteration.index else None,
        "cost": cost_of_trial(task.cost, measured),
        "cpu_seconds": cpu_seconds,
    }


class _Robot:
    """The simulated cart-pole, reset before every trial.

    Attributes:
        true_states: Of the last trial, without noise, shape (H + 1, 4).
    """

    def __init__(self, seed: int) -> None:
        settings = CartPoleSettings(
            seed=seed, start_spread=START_SPREAD, position_noise=NOISE, velocity_noise=NOISE
        )
        self._simulation = CartPoleSimulation(settings, PARAMETERS)
        self.true_states = np.empty((0, 4))

    def run(self, policy: Policy) -> Rollout:
        states: list[Array] = []
        acting = PolicyOf(CART_POLE_JOINTS, policy)

        def note() -> None:
            states.append(self._simulation.true_state)

        trial = run_trial(self._simulation, acting, HORIZON, CONTROL_PERIOD, note)
        self.true_states = np.stack(states)[:: round(CONTROL_PERIOD * 1e9) // PERIOD]
        self._simulation.reset()
        return trial
