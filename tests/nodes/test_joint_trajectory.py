"""A robot that takes positions only, through a receiver as JointTrajectoryController is documented.

It refuses a trajectory that does not end at rest, begins one without a stamp at once, from where
the robot is, and goes through its points by cubic splines; at its end it stays.
"""

from itertools import pairwise

import numpy as np
import pytest
from controlled_robot import CONTROLLER, HORIZON, JOINTS, ROBOT, trigger_when_heard
from fake_robot import STEP, FakeRobot
from trajectory_msgs.msg import JointTrajectory

from irlpilco_ros.experience.policy_file import write_policy_file
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.policies import OpenLoopPolicy
from irlpilco_ros.ros.qos import COMMAND_RECORDING

pytestmark = pytest.mark.dds

TOPIC = "joint_trajectory_controller/joint_trajectory"
OUTPUT = {"joint_trajectory_output": True}


class PositionRobot(FakeRobot):
    """Follows short trajectories, in its own time; deaf to velocities."""

    def __init__(self, ros, joints, **options):
        super().__init__(ros, joints, **options)
        self.trajectories: list[JointTrajectory] = []
        self.refused: list[str] = []
        self._begun = [(0.0, self.vector("positions"), self.vector("velocities"))]
        self._since = 0.0
        ros.node.create_subscription(JointTrajectory, TOPIC, self._follow, COMMAND_RECORDING)

    def _take(self, message):
        self.commands.append(message)

    def _follow(self, message):
        self.trajectories.append(message)
        order = [message.joint_names.index(joint) for joint in self.joints]
        points = [
            (
                point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec,
                np.array(point.positions)[order],
                np.array(point.velocities)[order],
            )
            for point in message.points
        ]
        if np.any(points[-1][2]):
            self.refused.append("velocity of the last trajectory point is not zero")
        elif message.header.stamp.sec or message.header.stamp.nanosec:
            self.refused.append("begins in the past, or later")
        else:
            now = (0.0, self.vector("positions"), self.vector("velocities"))
            self._begun, self._since = [now, *points], 0.0
        self._answer.set()

    def go_on(self, steps):
        """Let time go on, once it is no longer the thread that does."""
        for _ in range(steps):
            self._advance()

    def _advance(self):
        self._since += STEP
        positions, velocities = spline(self._begun, self._since)
        self.positions.update(zip(self.joints, positions.tolist(), strict=True))
        self.velocities.update(zip(self.joints, velocities.tolist(), strict=True))
        self.stamp += round(STEP * 1e9)


def spline(points, time):
    """Cubic Hermite through (time, position, velocity); at rest behind the last."""
    for (t0, p0, v0), (t1, p1, v1) in pairwise(points):
        if time <= t1:
            h = t1 - t0
            s = (time - t0) / h
            a = 2.0 * (p0 - p1) + h * (v0 + v1)
            b = 3.0 * (p1 - p0) - h * (2.0 * v0 + v1)
            position = p0 + s * h * v0 + s**2 * b + s**3 * a
            return position, v0 + (2.0 * s * b + 3.0 * s**2 * a) / h
    return points[-1][1], 0.0 * points[-1][2]


def test_it_goes_to_the_start_and_does_a_trial(ros, tmp_path):
    policy = OpenLoopPolicy(np.array([[0.1, -0.2]] * HORIZON), np.array([1.0, 2.0]), 4)
    path = tmp_path / "policy.yaml"
    write_policy_file(path, policy, Joints(tuple(JOINTS)), {**ROBOT, "start_position": [0.3, 0.1]})
    ros.start(CONTROLLER, files=[path], parameters=OUTPUT)
    with PositionRobot(ros, JOINTS, lockstep=True) as robot:
        ros.wait_for(lambda: robot.states, "states")
        answer = trigger_when_heard(ros, "controller/move_to_start")
        assert answer.success, answer.message
        np.testing.assert_allclose(robot.vector("positions"), [0.3, 0.1], atol=0.002)
        started = robot.vector("positions")
        answer = trigger_when_heard(ros, "controller/run_trial")
        assert answer.success, answer.message
    robot.go_on(30)
    # What it ends at is the integral of what was commanded, though it lags by a tenth of a second.
    np.testing.assert_allclose(robot.vector("positions") - started, [0.04, -0.08], atol=1e-3)
    assert robot.refused == []
    assert all(set(message.joint_names) == set(JOINTS) for message in robot.trajectories)


def test_a_stopped_robot_stays_where_it_is(ros):
    ros.start(CONTROLLER, parameters={**ROBOT, **OUTPUT, "start_position": [0.9, 0.0]})
    with PositionRobot(ros, JOINTS, lockstep=True) as robot:
        ros.wait_for(lambda: robot.states, "states")
        call = ros.trigger_async("controller/move_to_start")
        ros.wait_for(lambda: robot.vector("positions")[0] > 0.2, "the way")
        assert ros.trigger("controller/stop").success
        ros.wait_for(call.done, "the answer")
        ros.wait_for(lambda: not np.any(robot.trajectories[-1].points[0].velocities), "the last")
        target = dict(
            zip(
                robot.trajectories[-1].joint_names,
                robot.trajectories[-1].points[-1].positions,
                strict=True,
            )
        )
        places = [positions[JOINTS[0]] for _, positions in robot.states]
        assert target[JOINTS[0]] == pytest.approx(places[-1], abs=0.02)
    assert robot.refused == []


def test_efforts_are_no_velocities(ros):
    parameters = {**ROBOT, **OUTPUT, "command_interface": "effort", "effort_limit": [1.0, 2.0]}
    controller = ros.start(CONTROLLER, parameters=parameters, wait=False)
    controller.expected_code = 1
    assert controller.wait() == 1
    assert "joint_trajectory_output makes positions of velocities" in controller.output
    assert "Traceback" not in controller.output
