"""The recorder: demonstrations and trials into bags that survive whatever happens to it.

Services `start`, `stop` and `discard`. What it says is on disk is on disk; it records the bytes
that came over the wire, and nothing that it has recorded is ever deleted or overwritten.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.duration import Duration
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from irlpilco_ros.experience.bag_files import mark_discarded
from irlpilco_ros.experience.bag_message import BagTopic
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.joint_state_cdr import NANOSECONDS, HeaderReader
from irlpilco_ros.experience.live_recording import LiveRecording
from irlpilco_ros.experience.sampling import Received
from irlpilco_ros.learning.settings import check, setting
from irlpilco_ros.ros.clients import Clients
from irlpilco_ros.ros.health import ERROR, OK, Health
from irlpilco_ros.ros.parameters import declare_settings
from irlpilco_ros.ros.qos import COMMAND_RECORDING, STATE_RECORDING
from irlpilco_ros.ros.runtime import run_node
from irlpilco_ros.ros.safe_subscription import Info, SafeSubscription
from irlpilco_ros.ros.suite_node import SuiteNode

FIRST_SAMPLE_TIMEOUT = 5.0
"""How long `start` waits for joint states of all joints [s]."""

_POLL = 0.02  # [s]
# A trial's last command may still be under way when `stop` comes: services do not wait for topics.
_SHORTEST_WAIT, _LONGEST_WAIT = 0.1, 5.0  # [s]
# After so many messages of each topic, services get their turn.
_BATCH = 100


@dataclass(frozen=True)
class RecorderSettings:
    """What the recorder records, and where to."""

    joints: tuple[str, ...] = setting((), "Names of the joints to record.")
    sample_rate: float = setting(
        2.0,
        "Samples per second of message time, as long as there are no commands.",
        unit="Hz",
        minimum=0.01,
        maximum=1000.0,
    )
    output_directory: str = setting("recordings", "Folder that gets the bags, 000, 001, ...")

    def __post_init__(self) -> None:
        check(self)


class DemonstrationRecorder(SuiteNode):
    """The node `demonstration_recorder`."""

    def __init__(self) -> None:
        """Declare the parameters and listen to the robot.

        Raises:
            InvalidSettingError: a parameter is wrong.
        """
        super().__init__("demonstration_recorder")
        self._settings = declare_settings(self, RecorderSettings, apply=self._change)
        self._recording: LiveRecording | None = None
        self._began = 0  # [ns] wall clock
        self._last: Path | None = None
        self._told = (0, "")
        self._headers = HeaderReader()
        self._health = Health(self, "ready")
        self._calls = Clients(self)
        self._catching_up = False
        self._states = SafeSubscription(
            self, JointState, "joint_states", self._on_state, STATE_RECORDING
        )
        self._commands = SafeSubscription(
            self, JointState, "joint_command", self._on_command, COMMAND_RECORDING
        )
        group = ReentrantCallbackGroup()
        self.create_service(Trigger, "~/start", self._on_start, callback_group=group)
        self.create_service(Trigger, "~/stop", self._on_stop, callback_group=group)
        self.create_service(Trigger, "~/discard", self._on_discard, callback_group=group)

    def shutdown(self) -> None:
        """Close the bag: a recording that ends with the node is whole."""
        if self._recording is not None:
            self._end()

    def _change(self, settings: RecorderSettings) -> None:
        """Take over parameters; they count from the next recording on."""
        self._settings = settings

    async def _on_start(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Begin a recording; answers when its first sample is on disk."""
        if self._recording is not None:
            response.message = f"already recording {self._recording.path or ''}".rstrip()
            return response
        settings = self._settings
        if not settings.joints:
            response.message = (
                "the parameter joints is empty; name the joints to record, for example by loading "
                "config/baxter.yaml (--ros-args --params-file config/baxter.yaml)"
            )
            return response
        period = round(NANOSECONDS / settings.sample_rate)
        directory = Path(settings.output_directory).expanduser().absolute()
        recording = LiveRecording(
            directory, settings.joints, period, self._state_topic, self._command_topic
        )
        self._began, self._recording, self._told = time.time_ns(), recording, (0, "")
        for _attempt in range(round(FIRST_SAMPLE_TIMEOUT / _POLL)):
            if recording.samples or recording.failure or self._recording is not recording:
                break
            await self._calls.sleep(_POLL)
        if recording.samples and not recording.failure:
            response.success = True
            response.message = f"recording {len(settings.joints)} joints; bag: {recording.path}"
            return response
        self._recording = None
        response.message = recording.failure or self._why_nothing_came(recording)
        self._health.report(ERROR, response.message)
        return response

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
        if self._recording is not recording:
            response.message = "another call ended the recording"
            return response
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
        return response

    def _end(self) -> tuple[bool, str]:
        """Close the recording; return whether it went well and what to say about it."""
        assert self._recording is not None
        recording, self._recording = self._recording, None
        recording.close()
        self._last = recording.path
        summary = recording.summary()
        self._health.report(ERROR if recording.failure else OK, recording.failure or "ready")
        return not recording.failure, f"{summary}; bag: {recording.path}"

    def _on_state(self, data: bytes, info: Info) -> None:
        self._take_state(data, info)
        self._catch_up()

    def _on_command(self, data: bytes, info: Info) -> None:
        self._take_command(data, info)
        self._catch_up()

    def _catch_up(self) -> None:
        """Take what else has come, from both topics in turn.

        The executor alone needs 0.2 ms for each message; a simulation at many times real time is
        faster than that.
        """
        if self._catching_up:
            return
        self._catching_up = True
        try:
            for _ in range(_BATCH):
                # Both of them, so that neither waits for the other.
                state, command = self._states.take_next(), self._commands.take_next()
                if not (state or command):
                    return
        finally:
            self._catching_up = False

    def _take_state(self, data: bytes, info: Info) -> None:
        if self._recording is not None and self._is_new(info):
            self._recording.take_state(self._received(data, info))
            self._tell(self._recording)

    def _take_command(self, data: bytes, info: Info) -> None:
        if self._recording is not None and self._is_new(info):
            self._recording.take_command(self._received(data, info))
            self._tell(self._recording)

    def _is_new(self, info: Info) -> bool:
        """Whether a message came after `start`; on a busy computer older ones may still queue."""
        return bool(info["received_timestamp"] >= self._began)

    def _received(self, data: bytes, info: Info) -> Received:
        stamp, names = self._headers.read(data)
        return Received(stamp, names, data, info["received_timestamp"], info["source_timestamp"])

    def _tell(self, recording: LiveRecording) -> None:
        """Tell /diagnostics, if there is anything new."""
        if (recording.samples, recording.failure) == self._told:
            return
        self._told = (recording.samples, recording.failure)
        if recording.failure:
            self._health.report(ERROR, recording.failure)
        else:
            self._health.report(OK, f"recording {recording.path}", samples=recording.samples)

    def _state_topic(self) -> BagTopic:
        return self._topic(self._states)

    def _command_topic(self) -> BagTopic:
        return self._topic(self._commands)

    def _topic(self, subscription: SafeSubscription) -> BagTopic:
        """Return what a bag should know about a topic."""
        name = subscription.topic_name
        publishers = self.get_publishers_info_by_topic(name)
        return BagTopic.joint_state(name, [qos_entry(each.qos_profile) for each in publishers])

    def _why_nothing_came(self, recording: LiveRecording) -> str:
        topic, absent = self._states.topic_name, ", ".join(recording.missing_joints)
        return (
            f"no joint state of all joints came on {topic} within {FIRST_SAMPLE_TIMEOUT:g} s "
            f"(missing: {absent or 'none'}; publishers: {self.count_publishers(topic)}); nothing "
            "is recorded. Is the robot or the simulator running, in the same namespace?"
        )


def qos_entry(profile: QoSProfile) -> dict[str, Any]:
    """Return a quality of service as rosbag2 writes it (metadata version 9)."""
    return {
        "history": profile.history.name.lower(),
        "depth": profile.depth,
        "reliability": profile.reliability.name.lower(),
        "durability": profile.durability.name.lower(),
        "deadline": _duration(profile.deadline),
        "lifespan": _duration(profile.lifespan),
        "liveliness": profile.liveliness.name.lower(),
        "liveliness_lease_duration": _duration(profile.liveliness_lease_duration),
        "avoid_ros_namespace_conventions": profile.avoid_ros_namespace_conventions,
    }


def _duration(duration: Duration) -> dict[str, int]:
    seconds, rest = divmod(duration.nanoseconds, NANOSECONDS)
    return {"sec": seconds, "nsec": rest}


def main() -> int:
    """Run the node until a signal ends it; return the exit code."""
    return run_node(DemonstrationRecorder)


if __name__ == "__main__":
    sys.exit(main())
