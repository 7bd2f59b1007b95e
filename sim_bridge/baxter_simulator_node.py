"""Node `baxter_simulator`: the simulated Baxter under the topic names of the real one."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState

from irlpilco_ros.experience.joint_state_cdr import JointStateMessage, decode
from irlpilco_ros.kinematics.rigid_motion import quaternion_of
from irlpilco_ros.ros.messages import time_message
from irlpilco_ros.ros.parameters import declare_settings
from irlpilco_ros.ros.qos import JOINT_COMMAND, OBJECT_POSE_PUB
from irlpilco_ros.ros.robot_frames import Frame, RobotFrames
from irlpilco_ros.ros.runtime import run_node
from irlpilco_ros.ros.safe_subscription import Info, SafeSubscription
from sim_bridge.baxter_simulation import INITIAL_POSE, BaxterSimulation
from sim_bridge.joints import GRIPPER_JOINTS
from sim_bridge.pile import PileCamera
from sim_bridge.robot_description import scene_urdf
from sim_bridge.scene_frames import SceneFrames
from sim_bridge.simulation_settings import SimulationSettings
from sim_bridge.simulator_node import SimulatorNode
from sim_bridge.viewer import Viewer

_OBJECT_EVERY = 10  # states between two looks at the object
_FRAMES_EVERY = 5  # states between two looks at the frames
_LOOKS = 10  # at an object that was just moved
_GRIPPER_EVERY = 5  # states between two messages of each gripper


class BaxterSimulatorNode(SimulatorNode):
    """Publishes Baxter's joint states; obeys velocities [rad/s] and ~/guide."""

    def __init__(self) -> None:
        """Build the robot and let time run.

        Raises:
            InvalidSettingError: a parameter has no sensible value.
            RenderingError: a viewer is asked for where there is no display.
        """
        super().__init__("baxter_simulator")
        self._settings = declare_settings(self, SimulationSettings, apply=self._change)
        self._baxter = BaxterSimulation(self._settings)
        self._viewer = Viewer(self._baxter) if self._settings.viewer else None
        self._camera = PileCamera(self._settings.object_noise, self._settings.seed)
        self._object_poses = self.create_publisher(PoseStamped, "object_pose", OBJECT_POSE_PUB)
        self._scene = SceneFrames(self._baxter.model)
        fixed = [Frame(*place) for place in self._scene.fixed()]
        self._frames = RobotFrames(self, scene_urdf(), fixed)
        self._guides = SafeSubscription(self, JointState, "~/guide", self._on_guide, JOINT_COMMAND)
        self.start(
            self._baxter,
            self._settings,
            f"robot and debris are back where they began, pose {INITIAL_POSE}",
        )

    def shutdown(self) -> None:
        """Stop time and close the viewer."""
        super().shutdown()
        if self._viewer is not None:
            self._viewer.close()

    def obey(self, message: JointStateMessage) -> None:
        """Move the arms."""
        self._baxter.command(message.names, message.velocities)

    def stepped(self, count: int) -> None:
        """Draw, and send the grippers as a real Baxter does, each in a message of its own."""
        if self._viewer is not None:
            self._viewer.update()
        if count % _OBJECT_EVERY == 0:
            self._publish_object_pose()
        if count % _FRAMES_EVERY == 0 and self._frames.is_wanted:
            self._publish_frames()
        if count % _GRIPPER_EVERY:
            return
        stamp = time_message(self.stamp())
        for name in GRIPPER_JOINTS:
            message = JointState(name=[name], position=[0.0], velocity=[0.0], effort=[0.0])
            message.header.stamp = stamp
            self.publish(message)

    def details(self) -> dict[str, object]:
        """Return what /diagnostics is to tell about Baxter."""
        return {"preset": self._settings.preset}

    def _change(self, settings: SimulationSettings) -> None:
        """Lay the pile where it is wanted now; all else cannot be changed while time runs."""
        moved, self._settings = settings.object_place != self._settings.object_place, settings
        with self._changed:
            self._baxter.lay_pile(settings.object_place)
        if moved:
            x, y, turn = settings.object_place
            self.get_logger().info(f"the pile is moved by ({x:g}, {y:g}) m and {turn:g} rad")
        for _ in range(_LOOKS):  # time may stand still, in lockstep
            self._publish_object_pose()

    def _publish_frames(self) -> None:
        with self._changed:
            places = self._scene.moving(self._baxter.data, self._baxter.object_place)
        self._frames.publish(self.stamp(), [Frame(*place) for place in places])

    def _publish_object_pose(self) -> None:
        """Tell where the pile lies, as a camera sees it."""
        seen = self._camera.look(self._baxter.object_place)
        message = PoseStamped()
        message.header.stamp, message.header.frame_id = time_message(self.stamp()), "base"
        place, turn = message.pose.position, message.pose.orientation
        place.x, place.y, place.z = map(float, seen[:3, 3])
        turn.x, turn.y, turn.z, turn.w = map(float, quaternion_of(seen))
        self._object_poses.publish(message)

    def _on_guide(self, data: bytes, _info: Info) -> None:
        hands = decode(data)
        self.take(lambda: self._baxter.guide(hands.names, hands.positions, hands.velocities))


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM."""
    return run_node(BaxterSimulatorNode, argv)


if __name__ == "__main__":
    sys.exit(main())
