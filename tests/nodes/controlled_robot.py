"""The robot of two joints that the tests of the controller's process have, and its policies."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.experience.policy_file import policy_to_parameters
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.policies import OpenLoopPolicy

CONTROLLER = "irlpilco_ros.nodes.controller"
JOINTS = ["elbow", "wrist"]
ROLES = Joints(tuple(JOINTS))
HORIZON = 4
PERIOD = 0.1
ROBOT = {
    "joints": JOINTS,
    "position_lower": [-1.0, -1.0],
    "position_upper": [1.0, 1.0],
    "velocity_limit": [1.0, 2.0],
    "control_period": PERIOD,
    "horizon": HORIZON,
    # The robot is a thread of this process, which a busy computer may keep silent for a while.
    "state_timeout": 2.0,
}


def table(*rows):
    """A policy that sends these rows, joints in order."""
    return policy_to_parameters(OpenLoopPolicy(np.array(rows), np.array([1.0, 2.0]), 4), ROLES)


MOVING = table(*[[0.1, -0.2]] * HORIZON)
LONG = {**ROBOT, "horizon": 1000}  # a trial that does not end by itself
