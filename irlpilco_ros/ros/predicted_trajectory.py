"""The message on `learner/predicted_trajectory`: what the model expects of the next trial."""

from __future__ import annotations

from builtin_interfaces.msg import Duration, Time
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.iteration import Iteration
from irlpilco_ros.ros.messages import time_message


def predicted_trajectory(
    iteration: Iteration, robot: RobotSettings, stamp: Time
) -> JointTrajectory:
    """Return the mean of the predicted states, one point per control period.

    Args:
        iteration: Holds the predicted means, shape (H + 1, 2J).
        robot: Joint names (J) and control period.
        stamp: When it was predicted.
    """
    joints = len(robot.joints)
    message = JointTrajectory(joint_names=list(robot.joints))
    message.header.stamp = stamp
    for step, state in enumerate(iteration.predicted_means):
        time = time_message(round(step * robot.control_period * 1e9))
        message.points.append(
            JointTrajectoryPoint(
                positions=state[:joints].tolist(),
                velocities=state[joints:].tolist(),
                time_from_start=Duration(sec=time.sec, nanosec=time.nanosec),
            )
        )
    return message
