"""What a learned policy has to be compared with: all made from the demonstration alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irlpilco_ros.control.motions import ActingPolicy
from irlpilco_ros.learning import LearningSettings, Task
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.learning.starts.initial_policy import initial_policy, open_loop_policy


@dataclass(frozen=True)
class PdTracking:
    """u[t] = demonstrated speed + kp (shown - measured position) + kd (shown - measured speed).

    It decides as seldom as the learned policies, once per control period. The gains are the best of
    eleven pairs that were tried on the default robot and three perturbed ones.

    Attributes:
        states: The demonstration, shape (H + 1, 2J) [rad, rad/s].
        speeds: Its mean speeds between the ticks, shape (H, J) [rad/s].
        limit: Largest speed of each joint, shape (J,) [rad/s].
        position_gain: kp [1/s].
        velocity_gain: kd.
    """

    states: Array
    speeds: Array
    limit: Array
    position_gain: float = 2.0
    velocity_gain: float = 0.6

    def act(self, state: Array, step: int) -> Array:
        """Return the speeds (J,) [rad/s] for the state (2J,) at a tick."""
        joints = len(self.limit)
        deviation = self.states[step] - state
        speeds = self.speeds[step] + self.position_gain * deviation[:joints]
        speeds = speeds + self.velocity_gain * deviation[joints:]
        clipped: Array = np.clip(speeds, -self.limit, self.limit)
        return clipped


def baselines(task: Task) -> dict[str, ActingPolicy]:
    """Return the policies by name.

    "replay" sends the demonstration's speeds; "tracking" is PD tracking of it; "cloning" is
    behavioural cloning, a ridge regression of its speeds on its states.
    """
    return {
        "replay": open_loop_policy(task),
        "tracking": PdTracking(
            task.reference_states(), task.demonstrated_controls(), task.control_limit
        ),
        "cloning": initial_policy(task, LearningSettings(policy="linear")),
    }
