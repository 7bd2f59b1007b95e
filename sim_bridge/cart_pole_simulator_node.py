"""Node `cart_pole_simulator`: the simulated cart-pole under the topic names of a robot."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from irlpilco_ros.experience.joint_state_cdr import JointStateMessage
from irlpilco_ros.ros.parameters import declare_settings
from irlpilco_ros.ros.runtime import run_node
from sim_bridge.cart_pole_simulation import CartPoleSettings, CartPoleSimulation
from sim_bridge.simulator_node import SimulatorNode


class CartPoleSimulatorNode(SimulatorNode):
    """Publishes the joint states of cart and pole; obeys efforts [N] on the cart."""

    def __init__(self) -> None:
        """Build the cart-pole and let time run.

        Raises:
            InvalidSettingError: a parameter has no sensible value.
        """
        super().__init__("cart_pole_simulator")
        settings = declare_settings(self, CartPoleSettings)
        self._cart_pole = CartPoleSimulation(settings)
        self.start(self._cart_pole, settings, "the pole hangs, held until the first command")

    def obey(self, message: JointStateMessage) -> None:
        """Push the cart."""
        self._cart_pole.command(message.names, message.efforts)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM."""
    return run_node(CartPoleSimulatorNode, argv)


if __name__ == "__main__":
    sys.exit(main())
