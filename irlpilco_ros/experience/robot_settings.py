"""What the controller and the learner must know about a robot: joints, limits, rates.

A second robot is a second YAML file with these keys (see config/baxter.yaml), not new code.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.experience.motion import MotionSettings
from irlpilco_ros.experience.parameters_file import settings_from_parameters
from irlpilco_ros.kinematics.description_file import kinematics_of
from irlpilco_ros.kinematics.tools import ToolSettings
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.features import REGISTRY, ComparedTools, Features
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.settings import check, extension_settings, options_of, setting

FAST = 20.0
"""Speed above which a limit is doubted [rad/s]."""


@dataclass(frozen=True)
class RobotSettings(MotionSettings):
    """Joints, limits and rates of one robot; J joints in the order of the state [q, q_dot].

    Settings of features are in `options`, named `<feature>.<setting>`. The robot's `tools` are
    settings of their own, and so is the URDF's text that was told on robot_description, its
    `description`; only features that compare tools need to know them.

    Raises:
        InvalidSettingError: a list has another length than `joints`, a joint is named twice,
            or a lower limit is not below its upper limit.
    """

    joints: tuple[str, ...] = setting(
        (),
        "Names of the joints that are learned, as in joint_states; the order of all lists with a "
        "value for each joint. Other joints are neither looked at nor moved.",
    )
    unactuated_joints: tuple[str, ...] = setting(
        (),
        "Those of `joints` that nobody commands, such as a pole that swings freely: policies see "
        "them, and joint_command leaves them out.",
    )
    continuous_joints: tuple[str, ...] = setting(
        (),
        "Those of `joints` that turn without end: model, policy and features see the sine and "
        "cosine of their angle. They may be shown anywhere; motions stop at their position limits "
        "all the same, so give them some that are never reached, such as 1000.",
    )
    sliding_joints: tuple[str, ...] = setting(
        (),
        "Those of `joints` whose positions are metres: what is told of them is told in [m]. It "
        "changes nothing else.",
    )
    position_lower: tuple[float, ...] = setting(
        (),
        "Lowest position of each joint, from its data sheet; [m] if it slides. A motion stops "
        "before it (position_margin) and beyond it; demonstrations and starts beyond are refused.",
        unit="rad",
    )
    position_upper: tuple[float, ...] = setting(
        (), "Highest position of each joint, likewise; [m] if it slides.", unit="rad"
    )
    velocity_limit: tuple[float, ...] = setting(
        (),
        "Largest speed of each joint, from its data sheet; [m/s] if it slides. Policies are "
        "learned within it (see velocity_limit_factor), a policy that may exceed it is refused, "
        "a larger command stops the robot. 0 holds a joint still.",
        unit="rad/s",
        minimum=0.0,
        maximum=10_000.0,
    )
    effort_limit: tuple[float, ...] = setting(
        (),
        "Largest effort of each joint, [N] if it slides: bounds policies and commands as "
        "velocity_limit does, if command_interface is 'effort'; else a larger one that the joint "
        "states tell stops the robot, and empty is no limit.",
        unit="Nm",
        minimum=0.0,
        maximum=100_000.0,
    )
    acceleration_limit: tuple[float, ...] = setting(
        (),
        "Largest change of each joint's commanded velocity; commands are brought within it, but "
        "for an emergency stop. Empty: commands may jump.",
        unit="rad/s^2",
        minimum=0.01,
    )
    command_interface: str = setting(
        "velocity",
        "What policies decide and joint_command carries: joint velocities or joint efforts. With "
        "efforts, learn with prior_mean: zero.",
        choices=("velocity", "effort"),
    )
    control_period: float = setting(
        0.5,
        "Time between two decisions of the policy. Shorter follows faster motions, and takes more "
        "decisions (horizon) and longer to learn.",
        unit="s",
        minimum=0.01,
        maximum=10.0,
    )
    horizon: int = setting(
        0,
        "Number of decisions in a trial; 0: as many as the demonstration takes.",
        minimum=0,
        maximum=10_000,
    )
    features: str = setting(
        "joints",
        "What a motion is compared with the demonstration by. joints: the joint positions; motion: "
        "these and their velocities; tools: where the robot's tools are, seen from the object.",
        choices=REGISTRY.names,
    )
    reset_service: str = setting(
        "",
        "Trigger service that brings a robot to its start which cannot go there by velocities, "
        "such as cart_pole_simulator/reset; empty: controller/move_to_start.",
    )
    start_spread: float = setting(
        0.0,
        "Least standard deviation of each state (positions and velocities) at the start of a trial "
        "that policies are learned for; 0: that of the trials so far.",
        minimum=0.0,
        maximum=10.0,
    )
    position_noise: float = setting(
        1e-3,
        "Standard deviation of the noise of measured positions; [m] of joints that slide. What "
        "repeats no better than this, learning takes for good.",
        unit="rad",
        minimum=1e-9,
        maximum=1.0,
    )
    velocity_noise: float = setting(
        1e-2,
        "Standard deviation of the noise of measured velocities; [m/s] of joints that slide.",
        unit="rad/s",
        minimum=1e-9,
        maximum=10.0,
    )
    options: Mapping[str, Any] = extension_settings(REGISTRY.classes)
    tools: ToolSettings = field(default_factory=ToolSettings)
    description: str = ""

    def __post_init__(self) -> None:
        check(self)
        self._check_lengths()
        if len(set(self.joints)) != len(self.joints):
            raise InvalidSettingError(f"RobotSettings.joints names a joint twice: {self.joints}")
        Joints(self.joints, self.unactuated_joints, self.continuous_joints)
        unknown = set(self.sliding_joints) - set(self.joints) | (
            set(self.sliding_joints) & set(self.continuous_joints)
        )
        if unknown:
            raise InvalidSettingError(
                f"RobotSettings.sliding_joints names {', '.join(sorted(unknown))}; expected some "
                "of RobotSettings.joints that do not turn (continuous_joints)"
            )
        limits = zip(self.joints, self.position_lower, self.position_upper, strict=True)
        for joint, lower, upper in limits:
            if lower >= upper:
                raise InvalidSettingError(
                    f"position limits of joint {joint} are [{lower}, {upper}] [rad]; "
                    "expected position_lower < position_upper"
                )

    def _check_lengths(self) -> None:
        if not self.joints:
            raise InvalidSettingError(
                "RobotSettings.joints is empty; name the robot's joints, for example by loading "
                "config/baxter.yaml (--ros-args --params-file config/baxter.yaml)"
            )
        names = ["position_lower", "position_upper", "velocity_limit"]
        if self.command_interface == "effort" or self.effort_limit:
            names.append("effort_limit")
        if self.acceleration_limit:
            if self.command_interface == "effort":
                raise InvalidSettingError(
                    "RobotSettings.acceleration_limit bounds velocities that are commanded; with "
                    "command_interface: effort leave it out"
                )
            names.append("acceleration_limit")
        for name in names:
            length = len(getattr(self, name))
            if length != len(self.joints):
                raise InvalidSettingError(
                    f"RobotSettings.{name} has {length} values for {len(self.joints)} joints; "
                    "expected one for each of RobotSettings.joints"
                )

    @cached_property
    def feature_map(self) -> Features:
        """What a motion is compared by, made for the robot's joints.

        Raises:
            InvalidSettingError: these features do not fit the robot.
            RobotDescriptionError: they need its tools, and these are not known.
        """
        chosen = REGISTRY.get(self.features)
        return chosen.of_tools(self.roles, options_of(self.options, chosen), self._compared_tools)

    def _compared_tools(self) -> ComparedTools:
        kinematics = kinematics_of(self.tools, self.joints, self.description)
        return ComparedTools(kinematics, self.tools.tool_size, self.tools.posture_price)

    @cached_property
    def roles(self) -> Joints:
        """The joints, and which of them are commanded or turn without end."""
        return Joints(self.joints, self.unactuated_joints, self.continuous_joints)

    def doubts(self) -> tuple[str, ...]:
        """Return a sentence for each limit that is allowed, but is hardly meant."""
        return (*self._narrow(), *self._boundless())

    def _narrow(self) -> tuple[str, ...]:
        """Name the joints that turn without end, but not once around within their limits."""
        turning = [self.joints.index(joint) for joint in self.continuous_joints]
        return tuple(
            f"joint {self.joints[joint]} turns without end (continuous_joints), but motions stop "
            f"at its position limits, [{self.lower[joint]:g}, {self.upper[joint]:g}] rad; give it "
            "some that it never reaches, such as 1000"
            for joint in turning
            if self.upper[joint] - self.lower[joint] < 4.0 * np.pi
        )

    def _boundless(self) -> tuple[str, ...]:
        """Name the joints with a velocity limit that bounds nothing."""
        if self.command_interface == "effort":
            return ()
        fast = np.flatnonzero(self.control_limit > FAST)
        return tuple(
            f"velocity_limit of joint {self.roles.commanded[joint]} is "
            f"{self.control_limit[joint]:g} rad/s, more than the {FAST:g} rad/s of the fastest "
            "arms; nothing else bounds how fast a policy may move it: is that meant?"
            for joint in fast
        )

    @cached_property
    def units(self) -> tuple[str, ...]:
        """Unit of each joint's position (J)."""
        return units_of(self.joints, self.sliding_joints)

    @cached_property
    def lower(self) -> NDArray[np.float64]:
        """Lower position limits (J,) [rad]."""
        return np.array(self.position_lower)

    @cached_property
    def upper(self) -> NDArray[np.float64]:
        """Upper position limits (J,) [rad]."""
        return np.array(self.position_upper)

    @cached_property
    def tolerance_share(self) -> NDArray[np.float64]:
        """How much of a tolerance in [rad] or [m] each joint has (J,): all of it, or less.

        A joint that goes less than 1 rad or 1 m in all has that much less of it: 0.05 rad is little
        for an arm, and more than a gripper of 0.04 m has.
        """
        return np.minimum(1.0, self.upper - self.lower)

    @cached_property
    def acceleration_limits(self) -> NDArray[np.float64]:
        """Largest change of each commanded velocity (F,) [rad/s^2]; empty without a limit."""
        limit = np.array(self.acceleration_limit)
        return limit[self.roles.commanded_columns] if limit.size else limit

    @cached_property
    def control_limit(self) -> NDArray[np.float64]:
        """Largest control (F,): [rad/s] for the velocity interface, [N] or [Nm] for effort."""
        effort = self.command_interface == "effort"
        limit = np.array(self.effort_limit if effort else self.velocity_limit)
        return limit[self.roles.commanded_columns]


def units_of(joints: Sequence[str], sliding: Collection[str]) -> tuple[str, ...]:
    """Return the unit of each joint's position: "rad", or "m" if it slides."""
    return tuple("m" if joint in sliding else "rad" for joint in joints)


def robot_from_parameters(parameters: Mapping[str, Any]) -> RobotSettings:
    """Return the robot of ROS parameters, with its tools; errors as `settings_from_parameters`."""
    robot = settings_from_parameters(RobotSettings, parameters)
    return dataclasses.replace(robot, tools=settings_from_parameters(ToolSettings, parameters))
