"""Small dynamics models and tasks that learning is tested with."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.gp.kernel import Hyperparameters
from irlpilco_ros.learning.joints import PolicyOf
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.prediction.dynamics_model import DynamicsModel
from irlpilco_ros.learning.rollout import Rollout
from irlpilco_ros.learning.task import Task

JOINTS, HORIZON, DT = 2, 6, 0.5


def toy_model(inputs: int, outputs: int, points: int = 12, seed: int = 0) -> DynamicsModel:
    """Return a GP of a smooth random function, with chosen hyperparameters."""
    rng = np.random.default_rng(seed)
    x = rng.standard_normal((points, inputs))
    y = 0.3 * np.sin(x @ rng.standard_normal((inputs, outputs)))
    hyperparameters = Hyperparameters(
        rng.uniform(0.5, 1.0, (outputs, inputs)), np.full(outputs, -1.0), np.full(outputs, -3.0)
    )
    return DynamicsModel.condition(x, y, hyperparameters)


class LaggingJoints:
    """Joints that move at 0.8 of their commanded speed after a lag, seen through noise."""

    def __init__(self, seed: int = 0, joints: int = JOINTS) -> None:
        self.rng = np.random.default_rng(seed)
        self.joints = joints

    def run(self, policy: Policy | PolicyOf, start: Array, horizon: int = HORIZON) -> Rollout:
        position = start[: self.joints] + 1e-3 * self.rng.standard_normal(self.joints)
        velocity = np.zeros(self.joints)
        states, controls = [self._see(position, velocity)], []
        for t in range(horizon):
            control = policy.act(states[-1], t)
            controls.append(control)
            for _ in range(10):
                velocity = velocity + 0.4 * (0.8 * control - velocity)
                position = position + 0.1 * DT * velocity
            states.append(self._see(position, velocity))
        return Rollout(np.array(states), np.array(controls))

    def _see(self, position: Array, velocity: Array) -> Array:
        noise = np.repeat([4e-4, 5e-3], self.joints) * self.rng.standard_normal(2 * self.joints)
        return np.concatenate([position, velocity]) + noise


def toy_demonstration(seed: int = 0, horizon: int = HORIZON) -> Rollout:
    """Return two joints that swing out and back, shown by hand."""
    t = np.arange(horizon + 1) / horizon
    positions = np.stack([0.4 * np.sin(np.pi * t), 0.3 - 0.3 * np.cos(2 * np.pi * t)], axis=1)
    states = np.hstack([positions, np.gradient(positions, DT, axis=0)])
    states[0, JOINTS:] = 0.0
    states += 1e-4 * np.random.default_rng(seed).standard_normal(states.shape)
    return Rollout(states, np.full((horizon, JOINTS), np.nan))


def toy_task(demonstrations: int = 1) -> Task:
    shown = tuple(toy_demonstration(seed) for seed in range(demonstrations))
    return Task(shown, DT, np.full(JOINTS, 2.0))
