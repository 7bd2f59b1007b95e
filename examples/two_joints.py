"""A robot of two joints learns a motion from one demonstration: no ROS, no simulator, no files."""

from itertools import islice

import numpy as np

from irlpilco_ros.learning import LearningSettings, Rollout, Task, apprenticeship, judge

PERIOD = 0.5  # [s] between two decisions
HORIZON = 8  # decisions in a trial
RNG = np.random.default_rng(0)


def measured(position, velocity):
    """Return the state [rad, rad/s] as noisy sensors report it."""
    return np.concatenate([position, velocity]) + RNG.normal(scale=[3e-4] * 2 + [3e-3] * 2)


def run_trial(policy):
    """Try a policy on a robot that is slower than it is told, and late."""
    position, velocity = START.copy(), np.zeros(2)
    states, controls = [measured(position, velocity)], []
    for step in range(HORIZON):
        controls.append(policy.act(states[-1], step))  # joint velocities [rad/s]
        for _ in range(50):
            velocity = velocity + 0.1 * ([0.8, 0.6] * controls[-1] - velocity)
            position = position + PERIOD / 50 * velocity
        states.append(measured(position, velocity))
    return Rollout(np.array(states), np.array(controls))


time = PERIOD * np.arange(HORIZON + 1)[:, None]
shown = np.hstack([np.sin(time * [0.9, 0.7]), [0.9, 0.7] * np.cos(time * [0.9, 0.7])])
START = shown[0, :2]
demonstration = Rollout(shown, np.full((HORIZON, 2), np.nan))  # by hand: nobody commanded it
task = Task((demonstration,), PERIOD, control_limit=np.array([2.0, 2.0]))
for iteration in islice(apprenticeship(task, LearningSettings(), run_trial), 5):
    error = judge(task, iteration.trial).rmse
    print(f"iteration {iteration.index}: {error:.4f} rad off", flush=True)
