"""Everything that can be set about the simulated Baxter."""

from __future__ import annotations

from dataclasses import dataclass

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.settings import check, setting
from sim_bridge.joints import ARM_JOINTS
from sim_bridge.pace_settings import PaceSettings
from sim_bridge.servo_presets import SERVO_PRESETS


@dataclass(frozen=True)
class SimulationSettings(PaceSettings):
    """The robot, its sensors, what lies on the table, and how time passes.

    Raises:
        InvalidSettingError: a value is out of its range, or `speed_factor` has a wrong length.
    """

    preset: str = setting(
        "compliant",
        "Servos: 'stiff' does nearly what it is told, 'compliant' is soft and 50 ms late, "
        "'delayed' runs 0.4 s behind.",
        choices=tuple(SERVO_PRESETS),
        read_only=True,
    )
    command_lag: float = setting(
        -1.0,
        "Time from a command's arrival to its effect; negative: that of the preset.",
        unit="s",
        minimum=-1.0,
        maximum=1.0,
        read_only=True,
    )
    speed_factor: tuple[float, ...] = setting(
        (1.0,),
        "Speed that each joint makes of a commanded 1 rad/s (a miscalibrated robot): one factor "
        "for all, or 14, left arm first, from the shoulder outwards.",
        minimum=0.0,
        maximum=3.0,
        read_only=True,
    )
    payload: float = setting(
        0.0,
        "Mass in each hand that the robot's gravity compensation does not know of.",
        unit="kg",
        minimum=0.0,
        maximum=2.2,
        read_only=True,
    )
    position_noise: float = setting(
        4e-4,
        "Standard deviation of measured positions; 0: none.",
        unit="rad",
        minimum=0.0,
        read_only=True,
    )
    velocity_noise: float = setting(
        5e-3,
        "Standard deviation of measured velocities; 0: none.",
        unit="rad/s",
        minimum=0.0,
        read_only=True,
    )
    debris: int = setting(
        0, "Number of pieces of debris on the table.", minimum=0, maximum=50, read_only=True
    )
    debris_seed: int = setting(
        0,
        "Seed of where the debris lies: the same seed, the same places.",
        minimum=0,
        read_only=True,
    )
    obstacle: tuple[float, ...] = setting(
        (),
        "Where a ball of 0.1 m across stands fast in the way of the arms, from Baxter's base (x "
        "forward, y to its left, z up); empty: nothing is in their way.",
        unit="m",
        read_only=True,
    )
    object_place: tuple[float, ...] = setting(
        (0.0, 0.0, 0.0),
        "Where the pile lies, relative to where the sweep was shown: x, y [m], and turned by [rad] "
        "about its middle. Setting it lays the debris there, as if nobody had swept.",
    )
    object_noise: tuple[float, ...] = setting(
        (0.002, 0.01),
        "Standard deviations of what object_pose tells: of x, y, z [m], and about each axis [rad].",
        minimum=0.0,
        read_only=True,
    )
    viewer: bool = setting(
        False, "Show the simulation in a window; needs a display.", read_only=True
    )

    def __post_init__(self) -> None:
        check(self)
        if len(self.speed_factor) not in (1, len(ARM_JOINTS)):
            raise InvalidSettingError(
                f"SimulationSettings.speed_factor has {len(self.speed_factor)} values; expected 1 "
                f"for all joints, or {len(ARM_JOINTS)}: {', '.join(ARM_JOINTS)}"
            )
        if len(self.obstacle) not in (0, 3):
            raise InvalidSettingError(
                f"SimulationSettings.obstacle has {len(self.obstacle)} values; expected 3, its "
                "place [x, y, z] [m], or none"
            )

        for name, size, meaning in (
            ("object_place", 3, "x, y [m], turn [rad]"),
            ("object_noise", 2, "one of lengths [m], one of angles [rad]"),
        ):
            if len(getattr(self, name)) != size:
                raise InvalidSettingError(
                    f"SimulationSettings.{name} has {len(getattr(self, name))} values; expected "
                    f"{meaning}"
                )

    @property
    def effective_lag(self) -> float:
        """Time from a command's arrival to its effect [s], with the preset's if none is set."""
        preset = SERVO_PRESETS[self.preset]
        return preset.command_lag if self.command_lag < 0.0 else self.command_lag
