"""Where the recorder puts its bags: whoever asks for another folder has nothing to set back."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
import robot_of_two
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from irlpilco_ros.ros.messages import time_message
from irlpilco_ros.ros.qos import JOINT_STATES_PUB

pytestmark = pytest.mark.dds

RECORDER = "irlpilco_ros.nodes.demonstration_recorder"
NAME = "demonstration_recorder"
NOT_YET = ("-r", f"/{NAME}/start:=/{NAME}/started_by_the_test")
"""Keeps `start` from whoever calls it, who is then between setting the folder and starting."""
CALLER = """
import sys
from pathlib import Path
from irlpilco_ros.ros.session import Session
from irlpilco_ros.ros.trial_runner import TrialRunner
with Session("learner") as session:
    session.run(TrialRunner(session.clients).record("controller/run_trial", Path(sys.argv[1])))
"""


class Recorder:
    """A recorder, and a robot that stands still for it."""

    def __init__(self, ros, folder: Path, *arguments: str, start: str = "start") -> None:
        self.ros = ros
        self.start = f"{NAME}/{start}"
        parameters = {"joints": robot_of_two.JOINTS, "output_directory": str(folder)}
        ros.start(RECORDER, *arguments, parameters=parameters)
        self.states = ros.publisher(JointState, "joint_states", JOINT_STATES_PUB, subscribers=1)
        self.stamp = 0

    def record(self) -> Path:
        """Record a little; return the folder that got the bag."""
        started = self.call(self.start)
        assert started.success, started.message
        self.call(f"{NAME}/stop")
        return Path(started.message.rpartition("bag: ")[2]).parent

    def call(self, name: str) -> Trigger.Response:
        answer = self.ros.trigger_async(name)

        def answered() -> bool:
            self.stamp += 10_000_000
            state = JointState(name=robot_of_two.JOINTS, position=[0.1, 0.2], velocity=[0.0, 0.0])
            state.header.stamp = time_message(self.stamp)
            self.states.publish(state)
            return answer.done()

        self.ros.wait_for(answered, f"an answer of {name}")
        return answer.result()

    @property
    def next_directory(self) -> str:
        return self.ros.get_parameter(NAME, "next_directory")


def test_the_folder_of_the_next_recording_counts_once(ros, tmp_path):
    recorder = Recorder(ros, tmp_path / "own")
    assert ros.set_parameters(NAME, {"next_directory": str(tmp_path / "trials")}).successful
    assert recorder.record() == tmp_path / "trials"
    assert recorder.next_directory == ""
    assert recorder.record() == tmp_path / "own"


def test_a_learner_that_is_killed_before_it_starts_a_recording_leaves_nothing_set(ros, tmp_path):
    recorder = Recorder(ros, tmp_path / "own", *NOT_YET, start="started_by_the_test")
    learner = ros.run([sys.executable, "-c", CALLER, str(tmp_path / "trials")])
    ros.wait_for(lambda: recorder.next_directory == str(tmp_path / "trials"), "the learner")
    learner.kill()
    ros.wait_for(lambda: recorder.next_directory == "", "the recorder to forget of it")
    assert recorder.record() == tmp_path / "own"
    assert not (tmp_path / "trials").exists()
