"""What goes wrong around a recorder is said, and never recorded as if it were right."""

from __future__ import annotations

import shutil
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from sensor_msgs.msg import JointState

from irlpilco_ros.experience.bag_reader import read_bag, read_messages
from irlpilco_ros.ros.messages import time_message
from irlpilco_ros.ros.qos import DIAGNOSTICS, JOINT_STATES_PUB

pytestmark = pytest.mark.dds

JOINTS = ("shoulder", "elbow", "wrist", "hand")
RECORDER = "irlpilco_ros.nodes.demonstration_recorder"


class Driver:
    """Two publishers of joint states, as two arms have, that say of time what the test says."""

    def __init__(self, ros, folder: Path, **parameters) -> None:
        self.ros = ros
        defaults = {"joints": list(JOINTS), "output_directory": str(folder)}
        self.process = ros.start(RECORDER, parameters={**defaults, **parameters})
        self.left = ros.publisher(JointState, "joint_states", JOINT_STATES_PUB, subscribers=1)
        self.right = ros.publisher(JointState, "joint_states", JOINT_STATES_PUB, subscribers=1)
        self.stamp = 50_000_000_000

    def state(self, joints=JOINTS, behind: int = 0) -> JointState:
        """Return what is told of joints; all move by 1 rad/s."""
        stamp = self.stamp - behind
        state = JointState(name=list(joints))
        state.header.stamp = time_message(stamp)
        state.position = [1e-9 * stamp] * len(joints)
        state.velocity = [1.0] * len(joints)
        return state

    def whole(self) -> None:
        """Tell all joints in one message."""
        self.left.publish(self.state())

    def halves(self) -> None:
        """Tell half of the joints each, 5 ms apart."""
        self.left.publish(self.state(JOINTS[:2]))
        self.right.publish(self.state(JOINTS[2:], behind=5_000_000))

    def move(self, seconds: float, tell) -> None:
        """Let time pass at 100 Hz."""
        for _ in range(round(100 * seconds)):
            self.stamp += 10_000_000
            tell()
            time.sleep(0.002)

    def call(self, name: str, tell):
        """Call a service of the recorder while the robot goes on telling."""
        answer = self.ros.trigger_async(f"demonstration_recorder/{name}")

        def answered() -> bool:
            self.stamp += 10_000_000
            tell()
            return answer.done()

        self.ros.wait_for(answered, f"an answer of {name}")
        return answer.result()


def test_publishers_milliseconds_apart_are_merged_and_one_that_dies_is_named(ros, tmp_path):
    driver = Driver(ros, tmp_path, motion_distance=10.0)
    health = ros.listen(DiagnosticArray, "/diagnostics", DIAGNOSTICS)
    assert (started := driver.call("start", driver.halves)).success, started.message
    driver.move(3.0, driver.halves)
    first = driver.call("stop", driver.halves)
    assert first.success, first.message
    assert " 0 missing, one every 0.500 s; nothing moved" in first.message, "not by motion_distance"
    recorded = read_bag(Path(first.message.rpartition("bag: ")[2]))
    assert len(recorded) >= 7
    np.testing.assert_allclose(recorded.positions[:, 2:].T, [recorded.stamps] * 2, atol=1e-6)
    np.testing.assert_allclose(
        recorded.positions[:, :2].T, [recorded.stamps + 0.005] * 2, atol=1e-6
    )

    assert driver.call("start", driver.halves).success
    driver.move(1.0, driver.halves)

    def one_of_them() -> None:
        driver.left.publish(driver.state(JOINTS[:2]))

    driver.move(2.0, one_of_them)
    second = driver.call("stop", one_of_them)
    assert not second.success
    assert "wrist, hand fell silent after" in second.message
    samples = read_bag(Path(second.message.rpartition("bag: ")[2]))
    assert not np.any(np.diff(samples.positions, axis=0) == 0.0), "nobody stood still"

    def told() -> bool:
        statuses = [status for message in health.messages for status in message.status]
        return any(
            status.level == DiagnosticStatus.ERROR and "wrist, hand fell silent" in status.message
            for status in statuses
        )

    ros.wait_for(told, "a word about the silence")


@pytest.mark.parametrize(
    ("spoil", "succeeds", "said"),
    [
        (lambda state: setattr(state, "velocity", []), True, "velocities are not published; they"),
        (
            lambda state: state.velocity.__setitem__(3, float("nan")),
            True,
            "velocities of hand are not published; they will be computed from positions",
        ),
        (
            lambda state: state.position.__setitem__(1, float("nan")),
            False,
            "unusable: elbow: not finite",
        ),
        (lambda state: state.position.pop(), False, "4 names, 3 positions"),
        (
            lambda state: setattr(state.header, "stamp", time_message(0)),
            False,
            "the stamp 0.000 s, which is none",
        ),
    ],
    ids=["no velocities", "NaN velocity", "NaN position", "short positions", "no stamps"],
)
def test_start_says_recording_only_of_what_can_be_learned_from(
    ros, tmp_path, spoil, succeeds, said
):
    driver = Driver(ros, tmp_path / "bags")

    def tell() -> None:
        state = driver.state()
        spoil(state)
        driver.left.publish(state)

    answer = driver.call("start", tell)
    assert answer.success == succeeds
    assert said in answer.message
    assert (tmp_path / "bags").exists() == succeeds


def test_a_recording_without_a_second_state_is_no_success(ros, tmp_path):
    driver = Driver(ros, tmp_path)
    assert driver.call("start", driver.whole).success
    answer = ros.trigger("demonstration_recorder/stop")
    if " 1 samples" in answer.message:
        assert not answer.success
        assert "nothing to learn of" in answer.message


def test_stamps_that_stand_still_while_the_robot_moves_end_the_recording(ros, tmp_path):
    driver = Driver(ros, tmp_path)
    assert driver.call("start", driver.whole).success
    driver.move(1.0, driver.whole)
    frozen = time_message(driver.stamp)

    def tell() -> None:
        state = driver.state()
        state.header.stamp = frozen
        driver.left.publish(state)

    driver.move(1.0, tell)
    answer = driver.call("stop", tell)
    assert not answer.success
    assert "do not advance beyond" in answer.message


@pytest.mark.parametrize(
    ("folder", "reason"),
    [("", "output_directory is empty"), ("~nobody_of_this_name/x", "no such user's home")],
)
def test_a_folder_that_is_none_is_refused_and_the_recorder_goes_on(ros, tmp_path, folder, reason):
    driver = Driver(ros, tmp_path)
    answer = ros.set_parameters("demonstration_recorder", {"output_directory": folder})
    assert not answer.successful
    assert reason in answer.reason
    assert driver.call("start", driver.whole).success
    assert (tmp_path / "000").is_dir()
    refused = ros.start(RECORDER, parameters={"output_directory": folder}, wait=False)
    refused.expected_code = 1
    assert refused.wait() == 1
    assert reason in refused.output


def test_a_bag_that_is_deleted_while_it_is_recorded_is_said_at_once(ros, tmp_path):
    driver = Driver(ros, tmp_path)
    health = ros.listen(DiagnosticArray, "/diagnostics", DIAGNOSTICS)
    assert driver.call("start", driver.whole).success
    shutil.rmtree(tmp_path / "000")

    def told() -> bool:
        """No state comes any more: it is noticed all the same."""
        return any(
            status.level == DiagnosticStatus.ERROR and "was deleted" in status.message
            for message in health.messages
            for status in message.status
        )

    ros.wait_for(told, "a word about the bag")
    assert "call stop" in driver.call("start", driver.whole).message
    answer = driver.call("stop", driver.whole)
    assert not answer.success
    assert f"{tmp_path / '000'}: the bag was deleted or renamed" in answer.message
    assert "on disk" not in answer.message
    assert driver.call("start", driver.whole).success


SET_CLOCK = """
import sys, time
from pathlib import Path
real, file, hour = time.time_ns, Path(sys.argv.pop(1)), 3600 * 10**9
# A computer whose clock was an hour ahead, and is set right when the file is there.
ahead = lambda: 0 if file.exists() else hour
time.time_ns = lambda: real() + ahead()
from irlpilco_ros.experience.running_clock import RunningClock
from irlpilco_ros.nodes.demonstration_recorder import main
mended = RunningClock.mended
RunningClock.mended = lambda self, received: mended(self, received + ahead())
sys.exit(main())
"""


def driver_of(ros, folder: Path, script: str) -> tuple[Driver, Path]:
    """Start a recorder by a script; return its driver and the file that the script looks at."""
    file = folder / "file"
    (folder / "recorder.py").write_text(script)
    command = [sys.executable, str(folder / "recorder.py"), str(file), "--ros-args"]
    for value in (f"joints:=[{','.join(JOINTS)}]", f"output_directory:={folder / 'bags'}"):
        command += ["-p", value]
    ros.run(command)
    ros.wait_for_node("demonstration_recorder")
    driver = Driver.__new__(Driver)
    driver.ros, driver.stamp = ros, 50_000_000_000
    driver.left = ros.publisher(JointState, "joint_states", JOINT_STATES_PUB, subscribers=1)
    return driver, file


def test_a_clock_that_is_set_back_costs_no_sample(ros, tmp_path):
    driver, setting = driver_of(ros, tmp_path, SET_CLOCK)
    assert (started := driver.call("start", driver.whole)).success, started.message
    driver.move(3.0, driver.whole)
    setting.touch()
    driver.move(3.0, driver.whole)
    answer = driver.call("stop", driver.whole)
    assert answer.success, answer.message
    assert " 0 missing, one every 0.500 s" in answer.message
    bag = Path(answer.message.rpartition("bag: ")[2])
    recorded = read_bag(bag)
    assert recorded.stamps[-1] - recorded.stamps[0] >= 6.0
    times = [message.log_time for message in read_messages(bag)]
    assert max(times) - min(times) < 600e9, "they go on as if nobody had set the clock"


def test_samples_follow_the_control_period_unless_a_rate_is_set(ros, tmp_path):
    driver = Driver(ros, tmp_path, control_period=0.1)
    for rate, period in ((0.0, 0.1), (4.0, 0.25)):
        assert ros.set_parameters("demonstration_recorder", {"sample_rate": rate}).successful
        assert driver.call("start", driver.whole).success
        driver.move(2.0, driver.whole)
        assert f"one every {period:.3f} s" in driver.call("stop", driver.whole).message


BUSY = """
import sys, time
from pathlib import Path
from irlpilco_ros.nodes import demonstration_recorder as module
file, begin = Path(sys.argv.pop(1)), module.DemonstrationRecorder._begin
def late(self, settings):
    time.sleep(1.0)
    file.touch()
    return begin(self, settings)
module.DemonstrationRecorder._begin = late
sys.exit(module.main())
"""


def test_what_came_before_the_start_is_not_recorded(ros, tmp_path):
    """Not even what waits in a queue, because the computer is busy."""
    driver, began = driver_of(ros, tmp_path, BUSY)
    waiting = []

    def tell() -> None:
        driver.whole()
        if not began.exists():
            waiting.append(driver.stamp)

    answer = driver.call("start", tell)
    assert answer.success, answer.message
    assert len(waiting) > 20
    first = read_bag(Path(answer.message.rpartition("bag: ")[2])).stamps[0]
    # The last of them may still be under way when the recorder looks.
    assert first >= 1e-9 * waiting[-10]
