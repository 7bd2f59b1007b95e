"""Node `baxter_simulator`: the simulated Baxter under the topic names of the real one."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from sensor_msgs.msg import JointState

from irlpilco_ros.experience.joint_state_cdr import JointStateMessage, decode
from irlpilco_ros.ros.messages import time_message
from irlpilco_ros.ros.parameters import declare_settings
from irlpilco_ros.ros.qos import JOINT_COMMAND
from irlpilco_ros.ros.runtime import run_node
from irlpilco_ros.ros.safe_subscription import Info, SafeSubscription
from sim_bridge.baxter_simulation import INITIAL_POSE, BaxterSimulation
from sim_bridge.joints import GRIPPER_JOINTS
from sim_bridge.simulation_settings import SimulationSettings
from sim_bridge.simulator_node import SimulatorNode
from sim_bridge.viewer import Viewer

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
        self._settings = declare_settings(self, SimulationSettings)
        self._baxter = BaxterSimulation(self._settings)
        self._viewer = Viewer(self._baxter) if self._settings.viewer else None
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

    def _on_guide(self, data: bytes, _info: Info) -> None:
        hands = decode(data)
        self.take(lambda: self._baxter.guide(hands.names, hands.positions, hands.velocities))


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM."""
    return run_node(BaxterSimulatorNode, argv)


if __name__ == "__main__":
    sys.exit(main())
