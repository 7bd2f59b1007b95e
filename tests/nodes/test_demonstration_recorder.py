"""The recorder as a process of its own: what it says it has recorded is in the bag."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from geometry_msgs.msg import PoseStamped
from joint_commands import joint_command
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from irlpilco_ros.experience.bag_reader import read_bag, read_messages, read_path, read_recording
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage, encode
from irlpilco_ros.experience.object_pose import decode_pose, recorded_object_pose
from irlpilco_ros.experience.recovery import recover
from irlpilco_ros.experience.trajectory import Trajectory
from irlpilco_ros.experience.trajectory_bag import write_trajectory
from irlpilco_ros.kinematics.rigid_motion import pose as rigid_pose
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.ros.messages import time_message
from irlpilco_ros.ros.qos import JOINT_STATES_PUB

pytestmark = pytest.mark.dds

JOINTS = ("elbow", "wrist", "hand")
TICK = 10_000_000  # [ns]
RECORDER = "irlpilco_ros.nodes.demonstration_recorder"
BAGS = Path(__file__).parents[2] / "bags"
# Two of the real recordings are enough here: a demonstration or trial takes two seconds.
RECORDINGS = [file.parent for file in sorted(BAGS.rglob("metadata.yaml"))][:2]


class Robot:
    """A robot whose clock goes as the test says, and the recorder that listens to it."""

    def __init__(self, ros, joints=JOINTS, namespace="", **parameters) -> None:
        self.ros = ros
        self.prefix = f"{namespace}/" if namespace else ""
        self.process = ros.start(
            RECORDER, parameters={"joints": list(joints), **parameters}, namespace=namespace
        )
        self.states = ros.publisher(
            JointState, f"{self.prefix}joint_states", JOINT_STATES_PUB, subscribers=1
        )
        self.commands = ros.publisher(
            JointState, f"{self.prefix}joint_command", QoSProfile(depth=100), subscribers=1
        )
        self.stamp = 7_000_000_000
        self.last = self.state()

    def state(self) -> JointState:
        """Return the state at this moment; where the joints are follows from the time."""
        state = JointState(name=["head", *JOINTS])
        state.header.stamp = time_message(self.stamp)
        state.position = [9.0, *position(self.stamp)]
        state.velocity = [0.0, *(2.0 * position(self.stamp))]
        return state

    def move(self, seconds: float, pace: float = 0.0) -> None:
        """Let time pass at 100 Hz of message time, with `pace` [s] of real time in between."""
        for _ in range(round(seconds * 1e9 / TICK)):
            self.stamp += TICK
            self.last = self.state()
            self.states.publish(self.last)
            time.sleep(pace)

    def trial(self, steps: int, pace: float = 0.0005) -> None:
        """Move as a controller makes it move: each state is answered, decisions every 0.5 s."""
        for tick in range(steps + 1):
            decided, speed = self.stamp, 0.0 if tick == steps else 0.1 * (tick + 1)
            for _ in range(1 if tick == steps else 50):
                self.commands.publish(joint_command(decided, JOINTS, [speed, -speed, 0.5 * speed]))
                self.move(0.01, pace)

    def call(self, name: str):
        """Call a service of the recorder while the robot stands still and repeats its state."""
        answer = self.ros.trigger_async(f"{self.prefix}demonstration_recorder/{name}")

        def answered() -> bool:
            self.states.publish(self.last)
            return answer.done()

        self.ros.wait_for(answered, f"an answer of {name}")
        return answer.result()


def position(stamp: int) -> np.ndarray:
    return np.array([1.0, 2.0, 3.0]) * (stamp * 1e-9)


def bag_of(answer) -> Path:
    assert answer.success, answer.message
    return Path(answer.message.rpartition("bag: ")[2])


def assert_true_to_robot(bag: Path) -> Trajectory:
    """Check every sample against where the robot was at its stamp."""
    recorded = read_bag(bag)
    expected = np.array([position(round(stamp * 1e9)) for stamp in recorded.stamps])
    np.testing.assert_array_equal(recorded.positions, expected)
    np.testing.assert_array_equal(recorded.velocities, 2.0 * expected)
    return recorded


def test_demonstrations_one_after_the_other(ros, tmp_path):
    robot = Robot(ros, output_directory=str(tmp_path / "bags"), namespace="/robot")
    started = robot.call("start")
    first = bag_of(started)
    assert first == tmp_path / "bags" / "000"
    assert len(read_bag(first)) == 1  # said to be recording: the first sample is on disk
    assert "already recording" in robot.call("start").message
    robot.move(2.0, pace=0.001)
    stopped = robot.call("stop")
    assert bag_of(stopped) == first
    assert "5 samples, 0 missing, one every 0.500 s" in stopped.message
    recorded = assert_true_to_robot(first)
    np.testing.assert_allclose(recorded.stamps, 7.0 + 0.5 * np.arange(5), atol=1e-9)
    rollout = recorded.rollout(Joints(JOINTS), 4)
    assert rollout.states.shape == (5, 6)
    assert not rollout.commanded
    recording = read_recording(first)
    assert recording.whole
    names = [topic.name for topic in recording.counts]
    assert sorted(names) == ["/robot/joint_states", "/robot/joint_states/full_rate"]
    for topic in recording.counts:
        assert yaml.safe_load(topic.qos_text)[0]["reliability"] == "reliable"

    assert not robot.call("stop").success
    second = bag_of(robot.call("start"))
    assert second.name == "001"
    marked = bag_of(robot.call("discard"))
    assert marked.name == "001.discarded"
    assert len(read_bag(marked)) == 1  # discarded, not deleted
    assert not robot.call("discard").success
    assert bag_of(robot.call("start")).name == "002"
    said = robot.process.output
    for line in ("ready to record 3 joints, told on /robot/joint_states", "recorded 5 samples"):
        assert said.count(line) == 1, line
    assert said.count("recording 3 joints; bag: ") == 3
    assert said.count("discarded, but not deleted; bag: ") == 1
    assert robot.process.stop() == 0
    assert read_recording(tmp_path / "bags" / "002").whole  # closed in good order by SIGINT


def test_a_trial_pairs_each_command_with_the_state_it_was_decided_on(ros, tmp_path):
    robot = Robot(ros, output_directory=str(tmp_path))
    robot.call("start")
    robot.move(0.73)  # the trial begins at no multiple of anything
    robot.trial(steps=6)
    robot.move(1.2)
    stopped = robot.call("stop")
    recorded = assert_true_to_robot(bag_of(stopped))
    assert recorded.missing == 0
    rollout = recorded.rollout(Joints(JOINTS), 6)
    begin = 7.73 + 0.5 * np.arange(7)
    np.testing.assert_allclose(rollout.states[:, 0], begin, atol=1e-12)
    speeds = 0.1 * np.arange(1, 7)
    np.testing.assert_array_equal(rollout.controls, np.outer(speeds, [1.0, -1.0, 0.5]))


def test_a_trial_that_broke_off_is_readable_and_says_so(ros, tmp_path):
    robot = Robot(ros, output_directory=str(tmp_path))
    robot.call("start")
    robot.trial(steps=3)
    recorded = assert_true_to_robot(bag_of(robot.call("stop")))
    with pytest.raises(Exception, match="the trial has 3 of 16 control periods"):
        recorded.rollout(Joints(JOINTS), 16)


def test_start_without_a_robot_says_what_is_missing(ros, tmp_path):
    robot = Robot(ros, joints=(*JOINTS, "tail"), output_directory=str(tmp_path / "bags"))
    answer = robot.call("start")
    assert not answer.success
    assert "missing: tail" in answer.message
    assert not (tmp_path / "bags").exists()
    assert robot.ros.set_parameters("demonstration_recorder", {"joints": list(JOINTS)}).successful
    assert robot.call("start").success


def test_a_clock_that_jumps_back_ends_the_recording_with_a_reason(ros, tmp_path):
    robot = Robot(ros, output_directory=str(tmp_path))
    bag = bag_of(robot.call("start"))
    robot.move(1.0, pace=0.001)
    robot.stamp = 0
    robot.move(0.1)
    answer = robot.call("stop")
    assert not answer.success
    assert "the robot's clock was reset; 3 samples" in answer.message
    assert len(assert_true_to_robot(bag)) == 3


def test_the_full_rate_is_on_disk_within_a_control_period_whatever_comes(ros, tmp_path):
    robot = Robot(ros, output_directory=str(tmp_path), control_period=0.2, sample_rate=0.1)
    bag = bag_of(robot.call("start"))
    robot.move(1.0, pace=0.002)
    end = 1e-9 * robot.stamp
    time.sleep(0.5)  # more than one control period, in which nothing comes
    robot.process.kill()
    path = read_path(bag)
    np.testing.assert_allclose(path.stamps, 7.0 + 0.01 * np.arange(101), atol=1e-9)
    assert path.stamps[-1] == pytest.approx(end)
    assert len(read_bag(recover(bag).path)) == 1
    np.testing.assert_array_equal(read_path(tmp_path / "000.recovered").positions, path.positions)


def test_a_thousand_states_of_a_hundred_joints_in_a_second_are_recorded(ros, tmp_path):
    joints = tuple(f"joint_{i}" for i in range(100))
    robot = Robot(ros, joints=joints, output_directory=str(tmp_path), control_period=0.1)
    message = JointStateMessage(robot.stamp, joints, (0.5,) * 100, (0.1,) * 100, (0.0,) * 100)
    robot.last = encode(message)
    bag = bag_of(robot.call("start"))
    begin = time.monotonic()
    for step in range(1, 3001):
        stamp = robot.stamp + step * 1_000_000
        robot.last = encode(replace(message, stamp=stamp, positions=(1e-3 * step,) * 100))
        time.sleep(max(0.0, begin + 1e-3 * step - time.monotonic()))
        robot.states.publish(robot.last)
    stopped = robot.call("stop")
    assert stopped.success, stopped.message
    assert "31 samples, 0 missing, one every 0.100 s" in stopped.message
    assert len(read_path(bag)) >= 2970


@pytest.mark.parametrize("seconds", [0.0, 0.3, 0.7])
def test_kill_9_loses_no_sample(ros, tmp_path, seconds):
    robot = Robot(ros, output_directory=str(tmp_path), sample_rate=100.0)
    bag = bag_of(robot.call("start"))
    robot.move(seconds, pace=0.002)  # every state is a sample: it is killed while it writes
    before = len(read_bag(bag))
    robot.process.kill()
    torn = read_recording(bag)
    assert not torn.whole
    content = {file.name: file.read_bytes() for file in bag.iterdir()}
    new = recover(bag).path
    assert {file.name: file.read_bytes() for file in bag.iterdir()} == content
    recorded = assert_true_to_robot(new)
    assert read_recording(new).whole
    assert len(recorded) >= max(1, before)
    np.testing.assert_allclose(recorded.stamps, 7.0 + 0.01 * np.arange(len(recorded)), atol=1e-9)


def test_a_full_disk_is_told_and_keeps_what_was_written(ros, tmp_path):
    robot = Robot(ros, output_directory=str(tmp_path))
    bag = bag_of(robot.call("start"))
    soft = (bag / "000_0.mcap").stat().st_size + 1000
    # A file size limit fails like a full disk, in the one process that is meant.
    import resource

    resource.prlimit(robot.process.popen.pid, resource.RLIMIT_FSIZE, (soft, soft))
    robot.move(5.0, pace=0.001)
    answer = robot.call("stop")
    assert not answer.success
    assert "cannot write" in answer.message
    assert len(assert_true_to_robot(bag)) >= 1
    assert os.path.getsize(bag / "000_0.mcap") <= soft


def synthetic_trial(folder: Path) -> Path:
    """A trial of 16 steps with all digits in use."""
    random = np.random.default_rng(5)
    names = tuple(f"joint_{i}" for i in range(14))
    commands = random.normal(size=(17, 14))
    commands[-1] = 0.0
    stamps = 1000.0 + 0.5 * np.arange(17)
    states = random.normal(size=(2, 17, 14))
    return write_trajectory(folder, Trajectory(names, stamps, states[0], states[1], commands))


@pytest.mark.parametrize("source", [None, *RECORDINGS], ids=lambda path: path and path.name)
@pytest.mark.parametrize("commands_first", [False, True])
def test_a_bag_replayed_over_dds_is_recorded_again(ros, tmp_path, source, commands_first):
    bag = synthetic_trial(tmp_path / "original") if source is None else source
    original = read_bag(bag)
    robot = Robot(ros, joints=original.joint_names, output_directory=str(tmp_path / "again"))
    # The recording begins with a state of long before, so that the first sample is no special case.
    robot.last = JointState(name=list(original.joint_names))
    before = max(TICK, round(original.stamps[0] * 1e9) - 10_000_000_000)
    robot.last.header.stamp = time_message(before)
    robot.last.position = robot.last.velocity = [0.0] * len(original.joint_names)
    robot.call("start")
    kinds = {"joint_states": robot.states, "joint_command": robot.commands}
    messages = list(read_messages(bag))
    if commands_first:
        # DDS keeps no order between topics: a command may overtake its state.
        for i in range(1, len(messages)):
            if messages[i].topic.name.endswith("joint_command"):
                messages[i - 1], messages[i] = messages[i], messages[i - 1]
    for message in messages:
        kinds[message.topic.name.rsplit("/", 1)[-1]].publish(message.data)
        time.sleep(0.01)
    recorded = bag_of(ros.trigger("demonstration_recorder/stop"))
    again = read_bag(recorded)
    assert again.joint_names == original.joint_names
    for field in ("stamps", "positions", "velocities", "commands"):
        np.testing.assert_array_equal(getattr(again, field)[1:], getattr(original, field))
    received = [each.data for each in read_messages(recorded) if not each.topic.is_full_rate]
    assert sorted(received[1:]) == sorted(message.data for message in messages)


def pose_message(x: float) -> PoseStamped:
    message = PoseStamped()
    message.pose.position.x, message.pose.orientation.w = x, 1.0
    return message


def told_poses(bag: Path) -> list[float]:
    """Return x of every pose of the object in a bag [m]."""
    return [
        float(decode_pose(message.data)[0, 3])
        for message in read_messages(bag)
        if message.topic.name == "/object_pose"
    ]


def test_where_the_object_is_belongs_into_every_bag(ros, tmp_path):
    robot = Robot(ros, output_directory=str(tmp_path / "bags"))
    objects = ros.publisher(PoseStamped, "object_pose", QoSProfile(depth=10), subscribers=1)

    def heard() -> Path:
        objects.publish(pose_message(0.5))
        objects.publish(pose_message(float("nan")))
        bag = bag_of(robot.call("start"))
        robot.move(1.0, 0.002)
        assert robot.call("stop").success
        return bag

    ros.wait_for(lambda: told_poses(heard())[:1] == [0.5], "a bag that begins with the pose")
    # What comes while it records is in it, too, and the samples are as ever.
    bag = bag_of(robot.call("start"))

    def recorded() -> bool:
        objects.publish(pose_message(0.7))
        robot.move(0.5, 0.002)
        return 0.7 in told_poses(bag)

    ros.wait_for(recorded, "a pose in the bag")
    assert robot.call("stop").success
    assert told_poses(bag)[0] in (0.5, 0.7)
    assert_true_to_robot(bag)
    found = read_recording(bag)
    assert found.whole
    topic = next(each for each in found.counts if each.name == "/object_pose")
    assert topic.message_type == "geometry_msgs/msg/PoseStamped"
    assert recorded_object_pose(bag) is not None


def test_a_parameter_says_where_the_object_is_if_nobody_does(ros, tmp_path):
    pose = [0.6, -0.1, 0.0, 0.0, 0.0, 0.3]
    robot = Robot(ros, output_directory=str(tmp_path / "bags"), object_pose=pose)
    bag = bag_of(robot.call("start"))
    robot.move(1.0, 0.002)
    assert robot.call("stop").success
    np.testing.assert_allclose(
        recorded_object_pose(bag), rigid_pose(pose[:3], pose[3:]), atol=1e-12
    )
    assert_true_to_robot(bag)
