"""The recorder: demonstrations and trials into bags that survive whatever happens to it.

Services `start`, `stop` and `discard`. What it says is on disk is on disk; it records the bytes
that came over the wire, and nothing that it has recorded is ever deleted or overwritten.
"""

from __future__ import annotations

import dataclasses
import sys
import time
from pathlib import Path

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.timer import Timer
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from irlpilco_ros.experience.bag_files import mark_discarded
from irlpilco_ros.experience.bag_message import BagMessage
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.joint_merging import Received
from irlpilco_ros.experience.joint_state_cdr import StreamReader
from irlpilco_ros.experience.live_recording import LiveRecording
from irlpilco_ros.experience.object_pose import ObjectSettings, encode_pose
from irlpilco_ros.experience.recorder_settings import RecorderSettings
from irlpilco_ros.experience.running_clock import RunningClock
from irlpilco_ros.ros.clients import Clients
from irlpilco_ros.ros.health import ERROR, OK, Health
from irlpilco_ros.ros.object_watch import ObjectWatch, SeenPose
from irlpilco_ros.ros.parameters import declare_settings
from irlpilco_ros.ros.passing_parameter import PassingParameter
from irlpilco_ros.ros.qos import COMMAND_RECORDING, STATE_RECORDING
from irlpilco_ros.ros.runtime import run_node
from irlpilco_ros.ros.safe_subscription import Info, SafeSubscription
from irlpilco_ros.ros.suite_node import SuiteNode
from irlpilco_ros.ros.topic_quality import joint_state_topic, object_pose_topic

FIRST_SAMPLE_TIMEOUT = 5.0
"""How long `start` waits for joint states of all joints [s]."""

NEXT_DIRECTORY_TIMEOUT = 10.0
"""How long the folder of the next recording waits for its `start` [s]."""

_POLL = 0.02  # [s]
# A trial's last command may still be under way when `stop` comes: services do not wait for topics.
_SHORTEST_WAIT, _LONGEST_WAIT = 0.1, 5.0  # [s]
_LONGEST_CATCHING_UP = 0.5  # [s]
# After so many messages of each topic, services get their turn.
_BATCH = 100
_QUIET = 1.0  # so long without any joint state [s] is worth a word


class DemonstrationRecorder(SuiteNode):
    """The node `demonstration_recorder`."""

    def __init__(self) -> None:
        """Declare the parameters and listen to the robot.

        Raises:
            InvalidSettingError: a parameter is wrong.
        """
        super().__init__("demonstration_recorder")
        self._settings = declare_settings(self, RecorderSettings, apply=self._change)
        self._next_directory = PassingParameter(self, "next_directory", NEXT_DIRECTORY_TIMEOUT)
        self._object = declare_settings(self, ObjectSettings, apply=self._change_object)
        self._recording: LiveRecording | None = None
        self._watcher: Timer | None = None
        self._last: Path | None = None
        self._told = (0, "")
        self._heard = 0.0  # [s] steady clock
        self._reader = StreamReader()
        self._wall = RunningClock()
        self._health = Health(self, "ready")
        self._calls = Clients(self)
        self._catching_up = False
        self._states = SafeSubscription(
            self, JointState, "joint_states", self._on_state, STATE_RECORDING
        )
        self._commands = SafeSubscription(
            self, JointState, "joint_command", self._on_command, COMMAND_RECORDING
        )
        self._objects = ObjectWatch(self, self._on_object_pose)
        self._group = group = ReentrantCallbackGroup()
        self.create_service(Trigger, "~/start", self._on_start, callback_group=group)
        self.create_service(Trigger, "~/stop", self._on_stop, callback_group=group)
        self.create_service(Trigger, "~/discard", self._on_discard, callback_group=group)
        self.get_logger().info(self._first_words())

    def shutdown(self) -> None:
        """Close the bag: a recording that ends with the node is whole."""
        if self._recording is not None:
            self._end()

    def _first_words(self) -> str:
        joints, topic = len(self._settings.joints), self._states.topic_name
        if not joints:
            return "the parameter joints is empty: set it to have something recorded"
        return f"ready to record {joints} joints, told on {topic}, into {self._settings.directory}"

    def _change(self, settings: RecorderSettings) -> None:
        """Take over parameters; they count from the next recording on."""
        self._settings = settings

    def _change_object(self, settings: ObjectSettings) -> None:
        """Take over where the object is if nobody tells; it counts from the next recording on."""
        self._object = settings

    async def _on_start(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Begin a recording; answers when its first sample is on disk."""
        settings = self._settings
        if settings.next_directory:
            self._next_directory.clear()
        if self._recording is not None:
            response.message = _busy(self._recording)
            return response
        if not settings.joints:
            response.message = (
                "the parameter joints is empty; name the joints to record, for example by loading "
                "config/baxter.yaml (--ros-args --params-file config/baxter.yaml)"
            )
            return response
        recording = self._begin(settings)
        for _attempt in range(round(FIRST_SAMPLE_TIMEOUT / _POLL)):
            if recording.samples or recording.failure or not self._is_current(recording):
                break
            await self._calls.sleep(_POLL)
        if recording.samples and not recording.failure:
            response.success = True
            words = [f"recording {len(settings.joints)} joints", recording.beginning()]
            response.message = "; ".join([*filter(None, words), f"bag: {recording.path}"])
            self.get_logger().info(response.message)
            return response
        if self._is_current(recording):
            self._close()
        response.message = recording.failure or self._why_nothing_came(recording)
        self.get_logger().error(response.message)
        self._health.report(ERROR, response.message)
        return response

    def _begin(self, settings: RecorderSettings) -> LiveRecording:
        """Record what comes from now on; what waits in the queues came before."""
        for _ in range(2 * STATE_RECORDING.depth):
            if not (self._states.take_next() | self._commands.take_next()):
                break
        self._wall, self._told, self._heard = RunningClock(), (0, ""), time.monotonic()
        self._recording = LiveRecording(
            settings.directory,
            settings.joints,
            settings.period,
            lambda: joint_state_topic(self, self._states.topic_name),
            lambda: joint_state_topic(self, self._commands.topic_name),
            settings.continuous_joints,
            settings.full_rate,
            settings,
            self._known_object(),
        )
        self._watcher = self.create_timer(
            settings.control_period,
            self._watch,
            callback_group=self._group,
            clock=Clock(clock_type=ClockType.STEADY_TIME),
        )
        return self._recording

    async def _on_stop(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """End the recording and say what it holds."""
        recording = self._recording
        if recording is None or recording.path is None:
            response.message = "not recording; call start first"
            return response
        waited = 0.0
        while waited < (_SHORTEST_WAIT if recording.settled else _LONGEST_WAIT):
            await self._calls.sleep(_POLL)
            waited += _POLL
        if not self._is_current(recording):
            response.message = "another call ended the recording"
            return response
        end = time.monotonic() + _LONGEST_CATCHING_UP
        while self._catch_up() and time.monotonic() < end:
            pass
        response.success, response.message = self._end()
        return response

    async def _on_discard(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Mark the recording under way, or else the last one, as not to be learned from."""
        if self._recording is not None and self._recording.path is not None:
            self._end()
        if self._last is None:
            response.message = "nothing to discard: this recorder has recorded nothing since"
            return response
        try:
            marked = mark_discarded(self._last)
        except (BagError, OSError) as error:
            response.message = f"cannot discard {self._last}: {error}"
            return response
        self._last = None
        response.success = True
        response.message = f"discarded, but not deleted; bag: {marked}"
        self.get_logger().info(response.message)
        return response

    def _end(self) -> tuple[bool, str]:
        """Close the recording; return whether it went well and what to say about it."""
        recording = self._close()
        self._last = recording.path
        succeeded, said = recording.outcome()
        quiet = time.monotonic() - self._heard
        if not recording.failure and quiet > _QUIET:
            said += f"; no joint state came in the last {quiet:.1f} s"
        self._health.report(OK if succeeded else ERROR, "ready" if succeeded else said)
        words = f"{said}; bag: {recording.path}"
        if succeeded:
            self.get_logger().info(f"recorded {words}")
        else:
            self.get_logger().error(words)
        return succeeded, words

    def _close(self) -> LiveRecording:
        """Record no more; the bag is whole then if there is one."""
        assert self._recording is not None
        recording, self._recording = self._recording, None
        if self._watcher is not None:
            self.destroy_timer(self._watcher)
        recording.close()
        return recording

    def _is_current(self, recording: LiveRecording) -> bool:
        """Whether nobody has ended a recording meanwhile."""
        return self._recording is recording

    def _watch(self) -> None:
        """Look after the bag once in a control period, whether messages come or not."""
        if self._recording is not None:
            self._recording.flush()
            self._tell(self._recording)

    def _on_state(self, data: bytes, info: Info) -> None:
        if self._recording is None:
            return
        self._heard = time.monotonic()
        self._recording.take_state(self._received(data, info))
        self._tell_progress(self._recording)
        self._catch_up()

    def _on_command(self, data: bytes, info: Info) -> None:
        if self._recording is None:
            return
        self._recording.take_command(self._received(data, info))
        self._tell_progress(self._recording)
        self._catch_up()

    def _on_object_pose(self, seen: SeenPose) -> None:
        if self._recording is not None:
            self._recording.take_other(self._pose_message(seen))

    def _known_object(self) -> list[BagMessage]:
        """Return where the object is, as far as that is known before a recording."""
        seen, now = self._objects.last, time.time_ns()
        if seen is not None:
            return [self._pose_message(dataclasses.replace(seen, received=now))]
        pose = self._object.pose
        if pose is None:
            return []
        return [self._pose_message(SeenPose(encode_pose(pose, now), pose, now, now))]

    def _pose_message(self, seen: SeenPose) -> BagMessage:
        topic = object_pose_topic(self, self._objects.topic_name)
        return BagMessage(topic, seen.data, seen.received, seen.sent)

    def _catch_up(self) -> bool:
        """Take what else has come, from both topics in turn; return whether more may be there.

        The executor alone needs 0.2 ms for each message; a simulation at many times real time is
        faster than that.
        """
        if self._catching_up:
            return False
        self._catching_up = True
        try:
            for _ in range(_BATCH):
                # Both of them, so that neither waits for the other.
                if not (self._states.take_next() | self._commands.take_next()):
                    return False
        finally:
            self._catching_up = False
        return True

    def _received(self, data: bytes, info: Info) -> Received:
        came = self._wall.mended(info["received_timestamp"])
        return Received(*self._reader.read(data)[:4], data, came, info["source_timestamp"])

    def _tell_progress(self, recording: LiveRecording) -> None:
        """Tell /diagnostics at once of samples and of the end."""
        if recording.samples != self._told[0] or recording.failure:
            self._tell(recording)

    def _tell(self, recording: LiveRecording) -> None:
        """Tell /diagnostics, if there is anything new."""
        fault = recording.fault
        if (recording.samples, fault) == self._told:
            return
        self._told = (recording.samples, fault)
        if fault:
            self._health.report(ERROR, fault, samples=recording.samples)
        else:
            self._health.report(OK, f"recording {recording.path}", samples=recording.samples)

    def _why_nothing_came(self, recording: LiveRecording) -> str:
        topic = self._states.topic_name
        words = f"publishers: {self.count_publishers(topic)}"
        if self._states.fault:
            words += f"; last message that was passed over: {self._states.fault}"
        return (
            f"no joint state of all joints came on {topic} within {FIRST_SAMPLE_TIMEOUT:g} s "
            f"({recording.obstacle()}; {words}); nothing is recorded. Is the robot or the "
            "simulator running, in the same namespace?"
        )


def _busy(recording: LiveRecording) -> str:
    """Return why another recording cannot begin."""
    if recording.failure:
        return f"the recording {recording.path} has ended; call stop ({recording.failure})"
    return f"already recording {recording.path or ''}".rstrip()


def main() -> int:
    """Run the node until a signal ends it; return the exit code."""
    return run_node(DemonstrationRecorder)


if __name__ == "__main__":
    sys.exit(main())
