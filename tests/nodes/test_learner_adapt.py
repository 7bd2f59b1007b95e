"""The learner carries a run over to where the object is, over DDS, with a robot of the test's."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import practising_arm
import pytest
from geometry_msgs.msg import PoseStamped
from planar_arm import PLANAR
from practising_arm import OBJECT, PERIOD, SETTINGS
from std_msgs.msg import String
from std_srvs.srv import Trigger
from test_learner import FakeRobot

from irlpilco_ros.experience.object_pose import displacement, shifted
from irlpilco_ros.experience.places import read_places
from irlpilco_ros.experience.policy_file import policy_from_parameters, read_policy_file
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.kinematics.rigid_motion import quaternion_of
from irlpilco_ros.learning.settings import values_of
from irlpilco_ros.ros.qos import LATCHED, OBJECT_POSE_PUB

pytestmark = pytest.mark.dds

PLACE = (-0.05, 0.04, 0.2)


class PlanarRobot(FakeRobot):
    """Controller and recorder of the planar arm."""

    def _try_policy(self):
        own = self.parameters["controller"]
        policy, _ = policy_from_parameters(own)
        self.seed += 1
        iteration = SimpleNamespace(policy=policy, index=self.seed)
        return practising_arm.record_trial(
            SimpleNamespace(iteration=iteration, parameters=own), Path(self._directory)
        )


def message_of(matrix: np.ndarray) -> PoseStamped:
    message = PoseStamped()
    place, turn = message.pose.position, message.pose.orientation
    place.x, place.y, place.z = map(float, matrix[:3, 3])
    turn.x, turn.y, turn.z, turn.w = map(float, quaternion_of(matrix))
    return message


class Workplace:
    """A learner with two trials behind it, and somebody who knows where the object is."""

    def __init__(self, graph, folder: Path, **parameters) -> None:
        self.graph, self.folder = graph, folder
        self.robot = PlanarRobot(graph, "")
        self.run = RunDirectory(folder / "run")
        bag = practising_arm.record_demonstration(folder / "shown")
        settings = {
            **values_of(SETTINGS),
            "demonstration": str(bag),
            "run_directory": self.run.path,
        }
        settings = {name: each for name, each in settings.items() if each != ()}
        self.learner = graph.start(
            "irlpilco_ros.nodes.learner",
            files=[practising_arm.robot_file(folder)],
            parameters={
                **{name: list(v) if isinstance(v, tuple) else v for name, v in settings.items()},
                "run_directory": str(self.run.path),
                **parameters,
            },
            wait=False,
        )
        graph.wait_for_node("learner")
        self.poses = graph.publisher(PoseStamped, "object_pose", OBJECT_POSE_PUB, subscribers=3)

    def adapt(self) -> Trigger.Response:
        return self.graph.trigger("learner/adapt")

    def move_object(self, *place: float) -> None:
        """Say once where the object is."""
        self.poses.publish(message_of(shifted(OBJECT, *place)))


def adapted_to(work: Workplace, *place: float) -> str:
    """Move the object and adapt, again if the pose was not heard yet."""

    def done() -> bool:
        work.move_object(*place)
        answer = work.adapt()
        assert answer.success, answer.message
        known = read_places(work.run.places_directory)[-1].object_pose
        return bool(np.allclose(displacement(OBJECT, known), place, atol=1e-6))

    work.graph.wait_for(done, f"the learner at {place}")
    return str(work.adapt().message)


def test_what_was_told_once_before_the_learner_began_counts(ros, tmp_path):
    early = ros.publisher(PoseStamped, "object_pose", OBJECT_POSE_PUB)
    early.publish(message_of(shifted(OBJECT, *PLACE)))
    answer = Workplace(ros, tmp_path).adapt()
    assert "no pose came" not in answer.message


def test_a_run_goes_where_its_object_goes(ros, tmp_path):
    work = Workplace(ros, tmp_path)
    unknown = work.adapt()
    assert not unknown.success
    assert "no pose came on /object_pose" in unknown.message
    assert "set the learner's parameter object_pose" in unknown.message
    first = ros.trigger("learn_iteration")
    assert first.success, first.message

    message = adapted_to(work, *PLACE)
    assert "moved by (-0.050, 0.040) m and 0.200 rad" in message
    assert "rad off, give or take" in message
    # The controller has the policy, with its start and period; nothing has moved.
    own = work.robot.parameters["controller"]
    in_force, _ = policy_from_parameters(own)
    on_file, _ = read_policy_file(work.run.policy_file(2))
    np.testing.assert_array_equal(in_force.parameters, on_file.parameters)
    assert own["trial_control_period"] == PERIOD
    there = read_places(work.run.places_directory)[-1].shown[0].rollout.states[0, :3]
    np.testing.assert_allclose(own["start_position"], there, atol=1e-9)
    assert len(work.run.metrics()) == 2

    trial = ros.trigger("learn_iteration")
    assert trial.success, trial.message
    row = work.run.metrics()[-1]
    assert (row.iteration, row.trial) == (2, 2)
    assert row.rmse_rad < 0.02

    # Out of reach: refused, and what is there stays.
    def refused() -> bool:
        work.move_object(0.5, 0.0, 0.0)
        return "out of reach" in work.adapt().message

    before = len(read_places(work.run.places_directory))
    ros.wait_for(refused, "a refusal")
    assert len(read_places(work.run.places_directory)) >= before

    # And no trial is made where the object is no more, until it is back.
    moved = ros.trigger("learn_iteration")
    assert not moved.success
    place = read_places(work.run.places_directory)[-1].object_pose
    way = np.linalg.norm(shifted(OBJECT, 0.5, 0.0, 0.0)[:3, 3] - place[:3, 3])
    assert f"the object has moved by {way:.3f} m" in moved.message
    assert "call learner/adapt" in moved.message
    assert len(work.run.metrics()) == 3

    def learned() -> bool:
        work.move_object(*displacement(OBJECT, place))
        return bool(ros.trigger("learn_iteration").success)

    ros.wait_for(learned, "a trial where the object is back")
    assert work.run.metrics()[-1].rmse_rad < 0.02


def test_a_parameter_tells_where_nobody_publishes(ros, tmp_path):
    pose = [0.47, 0.41, 0.0, 0.0, 0.0, 0.25]
    work = Workplace(ros, tmp_path, features="tools")  # compared by where the pen is
    assert ros.trigger("learn_iteration").success
    assert work.run.configuration()["posture_price"] == 0.1
    assert ros.set_parameters("learner", {"object_pose": pose}).successful
    moved = ros.trigger("learn_iteration")
    assert "the object has moved by 0.032 m and 0.050 rad" in moved.message
    answer = work.adapt()
    assert answer.success, answer.message
    assert "moved by (-0.030, 0.010) m and 0.050 rad" in answer.message


def test_another_speed_needs_no_object_and_lasts_for_learning(ros, tmp_path):
    work = Workplace(ros, tmp_path)
    assert ros.trigger("learn_iteration").success
    assert not ros.set_parameters("learner", {"speed": 1.6}).successful
    assert ros.set_parameters("learner", {"speed": 1.25}).successful
    answer = work.adapt()
    assert answer.success, answer.message
    assert "where it was shown, at 1.25 times the shown speed" in answer.message
    # 7 decisions for the motion of 8, which ends before the last of them.
    assert work.robot.parameters["controller"]["trial_horizon"] == 7
    assert ros.trigger("learn_iteration").success
    row = work.run.metrics()[-1]
    assert (row.iteration, row.robot_time_s) == (2, (8 + 8 + 7) * PERIOD)
    assert row.rmse_rad < 0.02


def test_where_no_urdf_is_named_what_is_told_counts(ros, tmp_path):
    work = Workplace(ros, tmp_path, urdf="")
    assert ros.trigger("learn_iteration").success
    pose = [0.47, 0.41, 0.0, 0.0, 0.0, 0.25]
    assert ros.set_parameters("learner", {"object_pose": pose}).successful
    assert "urdf is not set" in work.adapt().message
    ros.publisher(String, "robot_description", LATCHED, subscribers=1).publish(String(data=PLANAR))
    answer = work.adapt()
    assert answer.success, answer.message
    assert "moved by (-0.030, 0.010) m and 0.050 rad" in answer.message


def test_a_forecast_beyond_the_limit_is_refused(ros, tmp_path):
    pose = [0.47, 0.41, 0.0, 0.0, 0.0, 0.25]
    work = Workplace(ros, tmp_path, adapt_error_limit=1e-5)
    assert ros.trigger("learn_iteration").success
    assert ros.set_parameters("learner", {"object_pose": pose}).successful
    before = dict(work.robot.parameters["controller"])
    answer = work.adapt()
    assert not answer.success
    assert "more than adapt_error_limit, 1e-05 rad" in answer.message
    assert work.robot.parameters["controller"] == before
    assert not work.run.places_directory.exists()
