"""The simulated cart-pole, without ROS: forces in, noisy joint states out, 100 times a second."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.settings import check, setting
from sim_bridge.cart_pole_equations import CartPoleParameters, integrate
from sim_bridge.errors import InvalidCommandError
from sim_bridge.pace_settings import PaceSettings
from sim_bridge.sensor_reading import SensorReading

Vector = NDArray[np.float64]

CART_POLE_JOINTS = Joints(("cart", "pole"), unactuated=("pole",), continuous=("pole",))
PERIOD = 10_000_000  # [ns] between two joint states
COMMAND_TIMEOUT = 200_000_000  # [ns] after which a force ends that was not commanded again
FORCE_LIMIT = 10.0  # [N]


@dataclass(frozen=True)
class CartPoleSettings(PaceSettings):
    """The cart-pole's sensors and starts, and how time passes; defaults are PILCO's example."""

    start_spread: float = setting(
        0.1,
        "Standard deviation of each state [m, rad, m/s, rad/s] after a reset; 0: hanging at rest.",
        minimum=0.0,
        maximum=1.0,
        read_only=True,
    )
    position_noise: float = setting(
        0.01,
        "Standard deviation of measured positions; 0: none.",
        unit="rad",
        minimum=0.0,
        read_only=True,
    )
    velocity_noise: float = setting(
        0.01,
        "Standard deviation of measured velocities; 0: none.",
        unit="rad/s",
        minimum=0.0,
        read_only=True,
    )

    def __post_init__(self) -> None:
        check(self)


class CartPoleSimulation:
    """A cart on a track with a pole that swings freely, as its equations of motion have it.

    After a reset somebody holds the cart and the pole until the first command, so that a trial
    begins where the reset has put them. The same settings and calls give the same motion and the
    same readings bit for bit.
    """

    joint_names = CART_POLE_JOINTS.names
    commanded_names = CART_POLE_JOINTS.commanded
    robot_settings = RobotSettings(
        joints=CART_POLE_JOINTS.names,
        unactuated_joints=CART_POLE_JOINTS.unactuated,
        continuous_joints=CART_POLE_JOINTS.continuous,
        position_lower=(-100.0, -1000.0),
        position_upper=(100.0, 1000.0),
        velocity_limit=(100.0, 1000.0),
        effort_limit=(FORCE_LIMIT, 0.0),
        command_interface="effort",
    )
    """What a controller must know of it; the track has no end worth speaking of."""

    def __init__(
        self,
        settings: CartPoleSettings | None = None,
        parameters: CartPoleParameters | None = None,
    ) -> None:
        """Build the cart-pole, by default the thesis's; it stands at a random start."""
        self.settings = settings or CartPoleSettings()
        self.parameters = parameters or CartPoleParameters()
        self._resets = 0
        self.reset()

    @property
    def nanoseconds(self) -> int:
        """Simulated time since the last reset [ns], exact."""
        return self._periods * PERIOD

    @property
    def time(self) -> float:
        """Simulated time since the last reset [s]."""
        return self.nanoseconds * 1e-9

    @property
    def true_state(self) -> Vector:
        """[x, theta, x_dot, theta_dot] without noise, shape (4,) [m, rad, m/s, rad/s]."""
        return self._state.copy()

    def reset(self, seed: int | None = None) -> None:
        """Hang the pole anew, each time a little differently; time is 0 again.

        Args:
            seed: What start and noise depend on; None goes on from the settings' seed.
        """
        key = [self.settings.seed, self._resets] if seed is None else [seed]
        self._rng = np.random.default_rng(key)
        self._resets += 1
        self._state: Vector = self.settings.start_spread * self._rng.standard_normal(4)
        self._periods = 0
        self._force = 0.0
        self._force_ends: int | None = None  # nobody has commanded yet: somebody holds it
        self._measure()

    def command(self, names: Sequence[str], efforts: ArrayLike) -> None:
        """Push the cart [N], for 0.2 s or until the next command, within the limit of 10 N.

        Raises:
            InvalidCommandError: another joint than the cart, or no finite force.
        """
        forces = np.asarray(efforts, dtype=float)
        if tuple(names) != self.commanded_names or forces.shape != (1,):
            raise InvalidCommandError(
                f"{forces.size} efforts for joints: {', '.join(names) or 'none'}; expected one, "
                f"for the joint {self.commanded_names[0]}"
            )
        if not np.isfinite(forces[0]):
            raise InvalidCommandError("the force on cart is not finite; the command is ignored")
        self._force = float(np.clip(forces[0], -FORCE_LIMIT, FORCE_LIMIT))
        self._force_ends = self.nanoseconds + COMMAND_TIMEOUT

    def step(self) -> None:
        """Advance by 10 ms, the period of the joint states."""
        if self._force_ends is not None:
            force = self._force if self.nanoseconds < self._force_ends else 0.0
            self._state = integrate(self._state, force, PERIOD * 1e-9, self.parameters)
        self._periods += 1
        self._measure()

    def read(self) -> SensorReading:
        """Return the present joint states; asked again before `step`, the same ones."""
        return self._reading

    def _measure(self) -> None:
        settings = self.settings
        noise = np.array([settings.position_noise] * 2 + [settings.velocity_noise] * 2)
        measured = self._state + noise * self._rng.standard_normal(4)
        self._reading = SensorReading(
            stamp=self.nanoseconds,
            names=self.joint_names,
            positions=measured[:2],
            velocities=measured[2:],
            efforts=np.array([self._force, 0.0]),
        )
