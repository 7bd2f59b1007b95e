"""Any velocity-controlled arm from its MJCF, without ROS: for robots other than Baxter."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.learning.settings import check, setting
from sim_bridge.errors import InvalidCommandError
from sim_bridge.guided_motion import GuidedMotion
from sim_bridge.sensor_reading import SensorReading

Vector = NDArray[np.float64]

PANDA = Path(__file__).parent / "models" / "panda" / "panda.xml"
PERIOD = 10_000_000  # [ns] between two joint states


@dataclass(frozen=True)
class ArmSettings:
    """What differs from arm to arm of the same model."""

    speed_factor: tuple[float, ...] = setting(
        (1.0,), "Speed made of a commanded 1 rad/s: one factor for all joints, or one for each."
    )
    command_lag: float = setting(
        0.05, "Time from a command to its effect.", unit="s", minimum=0.0, maximum=1.0
    )
    position_noise: float = setting(
        4e-4, "Standard deviation of measured positions.", unit="rad", minimum=0.0
    )
    velocity_noise: float = setting(
        5e-3, "Standard deviation of measured velocities.", unit="rad/s", minimum=0.0
    )
    seed: int = setting(0, "Seed of the sensor noise.", minimum=0)

    def __post_init__(self) -> None:
        check(self)


class ArmSimulation:
    """An arm whose MJCF has one velocity actuator for each joint, of the same name.

    It is a `Robot` for `sim_bridge.episode`.
    """

    def __init__(self, model: Path = PANDA, settings: ArmSettings | None = None) -> None:
        """Build the arm; it stands at the model's zero positions."""
        self.settings = settings or ArmSettings()
        self.model = mujoco.MjModel.from_xml_path(str(model))
        self.data = mujoco.MjData(self.model)
        self.joint_names: tuple[str, ...] = tuple(
            self.model.actuator(index).name for index in range(self.model.nu)
        )
        joints = [self.model.joint(name) for name in self.joint_names]
        self._qpos = np.array([joint.qposadr[0] for joint in joints])
        self._dof = np.array([joint.dofadr[0] for joint in joints])
        self._steps = round(PERIOD * 1e-9 / self.model.opt.timestep)
        self._rng = np.random.default_rng(self.settings.seed)
        self.place(np.zeros(len(joints)))

    @cached_property
    def robot_settings(self) -> RobotSettings:
        """What a controller must know of this arm."""
        lower, upper = self.model.jnt_range[
            [self.model.joint(name).id for name in self.joint_names]
        ].T
        return RobotSettings(
            joints=self.joint_names,
            position_lower=tuple(lower),
            position_upper=tuple(upper),
            velocity_limit=tuple(self.model.actuator_ctrlrange[:, 1]),
        )

    def place(self, positions: ArrayLike, velocities: ArrayLike | None = None) -> None:
        """Put the arm somewhere, at rest unless velocities (J,) [rad/s] are given; time goes on.

        Args:
            positions: (J,) [rad].
            velocities: (J,) [rad/s].
        """
        self.data.qpos[self._qpos] = positions
        self.data.qvel[self._dof] = 0.0 if velocities is None else velocities
        mujoco.mj_forward(self.model, self.data)
        still = np.zeros(len(self.joint_names))
        self._waiting = deque([still] * round(self.settings.command_lag * 1e9 / PERIOD))
        self._commanded: Vector = still
        self._measure()

    def command(self, names: Sequence[str], velocities: ArrayLike) -> None:
        """Command the velocities (J,) [rad/s] of all joints; they act after the lag.

        Raises:
            InvalidCommandError: other joints than the arm's, in its order, or not finite.
        """
        values = np.asarray(velocities, dtype=float)
        if tuple(names) != self.joint_names or values.shape != (len(names),):
            raise InvalidCommandError(
                f"{values.size} velocities for {', '.join(names)}; expected one for each of "
                f"{', '.join(self.joint_names)}"
            )
        if not np.isfinite(values).all():
            raise InvalidCommandError("a velocity is not finite; the command is ignored")
        self._commanded = values

    def step(self) -> None:
        """Advance by 10 ms, the period of the joint states."""
        self._waiting.append(self._commanded)
        self.data.ctrl[:] = self._waiting.popleft() * np.asarray(self.settings.speed_factor)
        for _ in range(self._steps):
            mujoco.mj_step(self.model, self.data)
        self._measure()

    def read(self) -> SensorReading:
        """Return the present joint states; asked again before `step`, the same ones."""
        return self._reading

    def show(self, motion: GuidedMotion, dt: float) -> Vector:
        """Be guided through a motion by a person; returns the states every dt, (T + 1, 2J)."""
        times = np.arange(round(motion.duration / dt) + 1) * dt
        states = []
        for time in times:
            self.place(*motion.at(time))
            states.append(self.read().state(self.joint_names))
        return np.array(states)

    def _measure(self) -> None:
        joints = len(self.joint_names)
        noise = self._rng.standard_normal((2, joints))
        self._reading = SensorReading(
            stamp=round(self.data.time * 1e9),
            names=self.joint_names,
            positions=self.data.qpos[self._qpos] + self.settings.position_noise * noise[0],
            velocities=self.data.qvel[self._dof] + self.settings.velocity_noise * noise[1],
            efforts=self.data.qfrc_actuator[self._dof].copy(),
        )
