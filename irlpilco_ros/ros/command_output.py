"""Where the controller's commands go out, and where it hears whether anybody else commands."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

from rclpy.duration import Duration
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory

from irlpilco_ros.control.controller_settings import ControllerSettings
from irlpilco_ros.control.motions import Command, Vector
from irlpilco_ros.control.position_target import PositionTarget
from irlpilco_ros.experience.errors import BagError
from irlpilco_ros.experience.joint_state_cdr import JointStateMessage, decode, encode
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.ros.endpoint_names import full_name
from irlpilco_ros.ros.qos import COMMAND_RECORDING, JOINT_COMMAND
from irlpilco_ros.ros.receivers import is_heard_by_name, nobody_listens
from irlpilco_ros.ros.safe_subscription import Info, SafeSubscription
from irlpilco_ros.ros.trajectory_output import short_trajectory

_REMEMBERED = 1000  # commands of our own that may still be on their way back to us
_LAST_WORD = Duration(seconds=0.1)  # for the last zero velocity to be acknowledged


class CommandOutput:
    """Publishes commands, and compares what is heard on their topic with what was sent.

    The middleware does not tell who sent a message. So commands go out in an encoding of our own,
    which comes back byte by byte, and whatever else comes is somebody else's.
    """

    def __init__(
        self,
        node: Node,
        joints: Sequence[str],
        interface: str,
        settings: ControllerSettings,
        on_stranger: Callable[[str], None],
    ) -> None:
        """Publish on joint_command, and listen there.

        Args:
            node: The controller.
            joints: Those that are commanded (F).
            interface: "velocity" or "effort".
            settings: Of them `velocity_controller_output` and `joint_trajectory_output`: publish
                on velocity_controller/commands and joint_trajectory_controller/joint_trajectory,
                too.
            on_stranger: Called with a sentence for each command of somebody else.

        Raises:
            InvalidSettingError: efforts are no velocities that could be integrated.
        """
        if settings.joint_trajectory_output and interface != "velocity":
            raise InvalidSettingError(
                f"joint_trajectory_output makes positions of velocities; command_interface is "
                f"{interface!r}, expected 'velocity'"
            )
        self._node = node
        self._settings = settings
        self._joints = tuple(joints)
        self._interface = interface
        self._on_stranger = on_stranger
        self._last: tuple[Command, bytes] | None = None
        self._sent: deque[bytes] = deque(maxlen=_REMEMBERED)
        self._commands = node.create_publisher(JointState, "joint_command", JOINT_COMMAND)
        self._velocities = (
            node.create_publisher(Float64MultiArray, "velocity_controller/commands", JOINT_COMMAND)
            if settings.velocity_controller_output
            else None
        )
        self._target = PositionTarget()
        self._trajectories = (
            node.create_publisher(
                JointTrajectory, "joint_trajectory_controller/joint_trajectory", JOINT_COMMAND
            )
            if settings.joint_trajectory_output
            else None
        )
        self._heard = SafeSubscription(
            node, JointState, "joint_command", self._hear, COMMAND_RECORDING
        )

    @property
    def last(self) -> Command | None:
        """What was sent last, or None before anything was."""
        return None if self._last is None else self._last[0]

    def send(self, command: Command, measured: Vector | None) -> None:
        """Send a command on all outputs.

        Args:
            command: The command.
            measured: Positions of the commanded joints (F,); None if they are not known.
        """
        if self._last is None or self._last[0] is not command:
            self._last = command, self._encoded(command)
            self._sent.append(self._last[1])
        self._commands.publish(self._last[1])
        if self._velocities is not None:
            self._velocities.publish(Float64MultiArray(data=command.values.tolist()))
        if self._trajectories is not None and measured is not None:
            positions = self._target.follow(command, measured)
            self._trajectories.publish(short_trajectory(self._joints, positions, command.values))

    def listen(self) -> None:
        """Hear what has been commanded up to now."""
        self._heard.drain()

    def finish(self) -> None:
        """Wait until the last command has arrived."""
        self._commands.wait_for_all_acked(_LAST_WORD)

    def others(self) -> str:
        """Say who else could command the robot, as far as is known; empty if nobody."""
        own = self._node.get_fully_qualified_name()
        # Each node tells of its parameters, and is known there for as long as it lives. In the list
        # of nodes one that ends as soon as it is known stays for ever, now and then.
        nodes = self._node.get_publishers_info_by_topic("/parameter_events")
        if sum(full_name(each) == own for each in nodes) > 1:
            return f"there is a second node {own}; stop one of them"
        for publisher in filter(None, (self._commands, self._velocities, self._trajectories)):
            topic = publisher.topic_name
            found = self._node.get_publishers_info_by_topic(topic)
            names = {full_name(endpoint) for endpoint in found} - {own}
            if names:
                return (
                    f"{topic} is published by {', '.join(sorted(names))}, too; stop that first "
                    "(what was killed is forgotten after 20 s)"
                )
        return ""

    @property
    def is_heard(self) -> bool:
        """Whether a node of a known name would be moved by a command."""
        return is_heard_by_name(self._node, self._settings)

    def unheard(self) -> str:
        """Say that nobody would be moved by a command, as far as is known; empty if somebody is."""
        return nobody_listens(self._node, self._settings)

    def _encoded(self, command: Command) -> bytes:
        values = tuple(float(value) for value in command.values)
        velocities, efforts = ((), values) if self._interface == "effort" else (values, ())
        message = JointStateMessage(command.stamp, self._joints, (), velocities, efforts)
        return encode(message)

    def _hear(self, data: bytes, _info: Info) -> None:
        if data not in self._sent:
            self._on_stranger(f"somebody else commanded the robot: {_told(data)}")


def _told(data: bytes) -> str:
    try:
        message = decode(data)
    except BagError as error:
        return str(error)
    values = zip(message.names, message.command, strict=False)
    first = ", ".join(f"{name} {value:.4g}" for name, value in list(values)[:3])
    return f"{first}{', ...' if len(message.command) > 3 else ''} on joint_command"
