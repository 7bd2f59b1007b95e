"""The simulated Baxter, without ROS: commands in, noisy joint states out, 100 times a second."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from irlpilco_ros.experience.robot_settings import RobotSettings
from sim_bridge import debris
from sim_bridge.baxter_model import build_model
from sim_bridge.errors import DivergedError, InvalidCommandError
from sim_bridge.joint_servos import Drive, JointServos
from sim_bridge.joints import ARM_JOINTS, PUBLISHED_JOINTS
from sim_bridge.pile import lay_debris
from sim_bridge.sensor_reading import SensorReading
from sim_bridge.servo_presets import SERVO_PRESETS
from sim_bridge.simulation_settings import SimulationSettings

Vector = NDArray[np.float64]

PERIOD = 10_000_000  # [ns] between two joint states
COMMAND_TIMEOUT = 0.2  # [s], Baxter's own
INITIAL_POSE = "untucked"
_BREAKDOWNS = (
    mujoco.mjtWarning.mjWARN_BADQPOS,
    mujoco.mjtWarning.mjWARN_BADQVEL,
    mujoco.mjtWarning.mjWARN_BADQACC,
)


class BaxterSimulation:
    """Baxter at its table: the physics, the servos and the sensors.

    The same settings, seed and calls give the same motion and the same readings bit for bit.
    """

    joint_names = ARM_JOINTS
    published_names = PUBLISHED_JOINTS

    def __init__(self, settings: SimulationSettings | None = None) -> None:
        """Build the robot; it stands in its initial pose and holds it."""
        self.settings = settings or SimulationSettings()
        self.model = build_model(self.settings)
        self.object_place: tuple[float, ...] = self.settings.object_place
        self.data = mujoco.MjData(self.model)
        joints = [self.model.joint(name) for name in ARM_JOINTS]
        self._qpos = np.array([joint.qposadr[0] for joint in joints])
        self._dof = np.array([joint.dofadr[0] for joint in joints])
        self._actuator = np.array([self.model.actuator(name).id for name in ARM_JOINTS])
        published = [self.model.joint(name) for name in PUBLISHED_JOINTS]
        self._published_qpos = np.array([joint.qposadr[0] for joint in published])
        self._published_dof = np.array([joint.dofadr[0] for joint in published])
        self._arm_in_published = np.array([PUBLISHED_JOINTS.index(name) for name in ARM_JOINTS])
        self._index = {name: i for i, name in enumerate(ARM_JOINTS)}
        self._steps_per_period: int = round(PERIOD * 1e-9 / self.model.opt.timestep)
        self._damping: Vector = np.array(self.model.dof_damping[self._dof])
        self._acceleration: Vector = np.zeros(self.model.nv)
        self._force: Vector = np.zeros(self.model.nv)
        factor, preset = np.array(self.settings.speed_factor), SERVO_PRESETS[self.settings.preset]
        self._servos = JointServos(
            velocity_limit=self.velocity_limit,
            speed_factor=np.broadcast_to(factor, (len(ARM_JOINTS),)).copy(),
            lag_steps=round(self.settings.effective_lag / self.model.opt.timestep),
            timeout_steps=round(COMMAND_TIMEOUT / self.model.opt.timestep),
            servo_lag_steps=preset.servo_lag / self.model.opt.timestep,
        )
        self.reset()

    @property
    def position_limits(self) -> NDArray[np.float64]:
        """Lower and upper limits of the arm joints, shape (2, 14) [rad]."""
        ids = [self.model.joint(name).id for name in ARM_JOINTS]
        return np.ascontiguousarray(self.model.jnt_range[ids].T)

    @property
    def velocity_limit(self) -> Vector:
        """Largest speed of the arm joints, shape (14,) [rad/s]."""
        return np.array(self.model.actuator_ctrlrange[self._actuator, 1])

    @cached_property
    def robot_settings(self) -> RobotSettings:
        """What a controller must know of this robot."""
        lower, upper = self.position_limits
        return RobotSettings(
            joints=self.joint_names,
            position_lower=tuple(lower),
            position_upper=tuple(upper),
            velocity_limit=tuple(self.velocity_limit),
        )

    @property
    def nanoseconds(self) -> int:
        """Simulated time since the last reset [ns], exact."""
        return self._step // self._steps_per_period * PERIOD

    @property
    def time(self) -> float:
        """Simulated time since the last reset [s]."""
        return self.nanoseconds * 1e-9

    @property
    def true_positions(self) -> Vector:
        """Positions of the arm joints without noise, shape (14,) [rad]."""
        return np.array(self.data.qpos[self._qpos])

    @property
    def true_velocities(self) -> Vector:
        """Velocities of the arm joints without noise, shape (14,) [rad/s]."""
        return np.array(self.data.qvel[self._dof])

    def reset(self, seed: int | None = None, positions: ArrayLike | None = None) -> None:
        """Put robot and debris back to where they began; time is 0 again.

        Args:
            seed: Seed of the sensor noise from now on; None takes the settings'.
            positions: (14,) of the arm joints [rad] to begin at; None is the initial pose.
        """
        key = self.model.key(INITIAL_POSE).id
        mujoco.mj_resetDataKeyframe(self.model, self.data, key)
        if any(self.object_place):
            lay_debris(self.model, self.data, key, self.object_place)
        if positions is not None:
            self.data.qpos[self._qpos] = self._checked("positions", ARM_JOINTS, positions)
        mujoco.mj_forward(self.model, self.data)
        self._servos.reset()
        self._rng = np.random.default_rng(self.settings.seed if seed is None else seed)
        self._step: int = 0
        self._measure()

    def command(self, names: Sequence[str], velocities: ArrayLike) -> None:
        """Command velocities [rad/s]; they act after the lag, for 0.2 s, clipped to the limits.

        Raises:
            InvalidCommandError: unknown or repeated names, wrong length, or not finite.
        """
        values = self._checked("velocities", names, velocities)
        self._servos.command(self._step, self._indices(names), values)

    def guide(self, names: Sequence[str], positions: ArrayLike, velocities: ArrayLike) -> None:
        """Move joints by hand, as a person does who teaches: the motors give way.

        For 0.2 s the joints go through `positions` [rad], now, and on at `velocities` [rad/s].

        Raises:
            InvalidCommandError: unknown or repeated names, wrong lengths, or not finite.
        """
        where = self._checked("positions", names, positions)
        speed = self._checked("velocities", names, velocities)
        self._servos.guide(self._step, self._indices(names), where, speed)

    def step(self) -> None:
        """Advance by 10 ms, the period of the joint states.

        Raises:
            DivergedError: the physics broke down; `reset` helps.
        """
        for _ in range(self._steps_per_period):
            self._substep()
        # MuJoCo starts anew in silence where it finds a number that is not finite.
        if any(self.data.warning[kind].number for kind in _BREAKDOWNS):
            raise DivergedError(
                f"the physics broke down at {self.time:.2f} s of simulated time: a position, "
                "velocity or acceleration was not finite; reset the simulation"
            )
        self._measure()

    def read(self) -> SensorReading:
        """Return the present joint states; asked again before `step`, the same ones."""
        return self._reading

    def lay_pile(self, place: Sequence[float]) -> None:
        """Lay the debris anew, with the pile elsewhere; the robot stays as it is.

        Args:
            place: x, y [m] and turn [rad], relative to where it lies when the sweep is shown.
        """
        self.object_place = tuple(place)
        lay_debris(self.model, self.data, self.model.key(INITIAL_POSE).id, place)
        mujoco.mj_forward(self.model, self.data)

    def debris_in_pan(self) -> int:
        """Return how many pieces of debris lie in the dustpan."""
        return debris.debris_in_pan(self.model, self.data)

    def _substep(self) -> None:
        model, data = self.model, self.data
        drive = self._servos.drive(
            self._step, model.opt.timestep, data.qpos[self._qpos], data.qvel[self._dof]
        )
        data.ctrl[self._actuator] = drive.velocities
        data.qfrc_applied[self._dof] = self._guide_force(drive)
        mujoco.mj_step(model, data)
        self._step += 1

    def _guide_force(self, drive: Drive) -> Vector:
        """Return the torques (14,) [Nm] of the guiding hand: inertia and friction, overcome."""
        if not drive.guide_accelerations.any():
            return drive.guide_accelerations
        self._acceleration[self._dof] = drive.guide_accelerations
        mujoco.mj_mulM(self.model, self.data, self._force, self._acceleration)
        return np.asarray(self._force[self._dof] + self._damping * drive.guide_velocities)

    def _measure(self) -> None:
        noise = self._rng.standard_normal((2, len(ARM_JOINTS)))
        positions = self.data.qpos[self._published_qpos]
        velocities = self.data.qvel[self._published_dof]
        positions[self._arm_in_published] += self.settings.position_noise * noise[0]
        velocities[self._arm_in_published] += self.settings.velocity_noise * noise[1]
        self._reading = SensorReading(
            stamp=self.nanoseconds,
            names=PUBLISHED_JOINTS,
            positions=positions,
            velocities=velocities,
            efforts=self.data.qfrc_actuator[self._published_dof],
        )

    def _indices(self, names: Sequence[str]) -> NDArray[np.intp]:
        return np.array([self._index[name] for name in names], dtype=np.intp)

    def _checked(self, what: str, names: Sequence[str], values: ArrayLike) -> Vector:
        unknown = [name for name in names if name not in self._index]
        if unknown:
            raise InvalidCommandError(
                f"unknown joints: {', '.join(unknown)}; this robot has {', '.join(ARM_JOINTS)}"
            )
        if len(set(names)) != len(names):
            raise InvalidCommandError(f"a joint is named twice: {', '.join(names)}")
        numbers = np.asarray(values, dtype=float)
        if numbers.shape != (len(names),) or not len(names):
            raise InvalidCommandError(
                f"{numbers.size} {what} for {len(names)} joint names; expected one for each"
            )
        if not np.isfinite(numbers).all():
            joint = names[int(np.argmax(~np.isfinite(numbers)))]
            raise InvalidCommandError(f"{what} of {joint} is not finite; the command is ignored")
        return numbers
