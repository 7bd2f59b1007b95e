"""A mass with a weak spring that drives away from 0, and a flag that follows it; one control."""

import numpy as np

from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.task import Task

DT = 0.1
STEPS = 12
LIMIT = np.array([4.0])
A = np.eye(4) + DT * np.array(
    [[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0], [2.0, 0.0, -0.1, 0.0], [1.0, -1.0, 0.0, -1.0]]
)
B = DT * np.array([[0.0], [0.0], [2.0], [0.0]])


def run(controls, start):
    states = [np.asarray(start, dtype=float)]
    for control in controls:
        states.append(A @ states[-1] + B @ control)
    return Rollout(np.array(states), controls)


def shown():
    """What is shown, with the commands that nobody is told."""
    return run(2.0 * np.sin(0.6 * np.arange(float(STEPS)))[:, None], np.zeros(4))


def task_of(states):
    return Task((Rollout(states, np.full((STEPS, 1), np.nan)),), DT, LIMIT)


def random_trials(number, seed=0, spread=0.3):
    rng = np.random.default_rng(seed)
    starts = spread * rng.standard_normal((number, 4))
    return [run(rng.uniform(-4.0, 4.0, (STEPS, 1)), start) for start in starts]
