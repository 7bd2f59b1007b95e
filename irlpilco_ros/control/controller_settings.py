"""How the controller moves the robot and when it stops it."""

from __future__ import annotations

from dataclasses import dataclass

from irlpilco_ros.learning.settings import check, setting


@dataclass(frozen=True)
class ControllerSettings:
    """What of the controller is neither the robot's nor the policy's; can be changed any time."""

    enabled: bool = setting(
        True, "Whether motions may start; controller/enable sets it, too. False stops the robot."
    )
    start_position: tuple[float, ...] = setting(
        (),
        "Joint positions at which trials start, in the order of `joints`: controller/move_to_start "
        "goes there. Set with the policy.",
        unit="rad",
    )
    trial_horizon: int = setting(
        0,
        "Number of decisions in a trial; set with the policy. 0: as `horizon` says.",
        minimum=0,
        maximum=10_000,
    )
    trial_control_period: float = setting(
        0.0,
        "Time between two decisions in a trial; set with the policy. 0: as `control_period` says.",
        unit="s",
        minimum=0.0,
        maximum=10.0,
    )
    start_tolerance: float = setting(
        0.001,
        "How near to its start position each joint must come for move_to_start to succeed. Smaller "
        "takes longer, and is never reached below the noise of measured positions.",
        unit="rad",
        minimum=1e-5,
        maximum=0.5,
    )
    start_speed_tolerance: float = setting(
        0.03,
        "How slow each joint must be for move_to_start to succeed; must be above the noise of "
        "measured speeds.",
        unit="rad/s",
        minimum=1e-4,
        maximum=1.0,
    )
    trial_start_tolerance: float = setting(
        0.05,
        "How far from its start position each joint may be when a trial begins (and five times "
        "`start_spread` more); less for one that goes less than 1 rad or 1 m in all, as for "
        "position_margin.",
        unit="rad",
        minimum=1e-4,
        maximum=1.0,
    )
    approach_speed: float = setting(
        0.4,
        "Largest speed of any joint on the way to the start, as far as velocity_limit allows.",
        unit="rad/s",
        minimum=0.01,
        maximum=4.0,
    )
    approach_acceleration: float = setting(
        2.0,
        "How fast the speed builds up on the way to the start; smaller is gentler.",
        unit="rad/s^2",
        minimum=0.01,
        maximum=100.0,
    )
    approach_delay: float = setting(
        0.6,
        "Longest time from a command to its effect that the way to the start allows for.",
        unit="s",
        minimum=0.0,
        maximum=5.0,
    )
    approach_timeout: float = setting(
        60.0,
        "Time after which a robot that is not at the start is stopped, and move_to_start fails.",
        unit="s",
        minimum=0.1,
        maximum=600.0,
    )
    state_timeout: float = setting(
        0.12,
        "Time (steady clock) without a joint state of a later stamp that stops the robot.",
        unit="s",
        minimum=0.02,
        maximum=1.0,
    )
    command_timeout: float = setting(
        0.2,
        "Time without a command after which the robot halts by its own rule; a motion in which "
        "the controller itself was away for longer ends.",
        unit="s",
        minimum=0.02,
        maximum=1.0,
    )
    stall_timeout: float = setting(
        1.0,
        "Time for which a joint may be commanded at 0.1 rad/s or more, beyond what holds it, and "
        "not move a tenth of the way, before the robot is stopped.",
        unit="s",
        minimum=0.2,
        maximum=10.0,
    )
    guard_sigma: float = setting(
        0.0,
        "A joint that is so many predicted standard deviations (and 0.02 rad) from where it was "
        "predicted at a tick of a trial stops the robot: something is in its way. 0: it is not "
        "looked at. Try 6.",
        minimum=0.0,
        maximum=1000.0,
    )
    position_margin: float = setting(
        0.05,
        "A joint this near to its limit and moving on stops the robot, as does one beyond it. One "
        "that goes less than 1 rad or 1 m in all has that much less: a gripper of 0.04 m 0.002 m. "
        "Negative, for simulation only: joints may lean on their stops and be that far beyond, and "
        "trials may push.",
        unit="rad",
        minimum=-1.0,
        maximum=1.0,
    )
    command_rate: float = setting(
        0.0,
        "Rate at which the last command is sent again while a motion is going on and joint states "
        "advance, for a receiver whose watchdog needs it; 0: with each new joint state only.",
        unit="Hz",
        minimum=0.0,
        maximum=1000.0,
        read_only=True,
    )
    guide_topic: str = setting(
        "baxter_simulator/guide",
        "Where a simulated robot is guided by hand: a message there ends a motion; empty: nowhere.",
        read_only=True,
    )
    velocity_controller_output: bool = setting(
        False,
        "Also publish commands on velocity_controller/commands (std_msgs/Float64MultiArray) for "
        "ros2_control's JointGroupVelocityController.",
        read_only=True,
    )
    joint_trajectory_output: bool = setting(
        False,
        "Also publish commands, integrated to positions, on "
        "joint_trajectory_controller/joint_trajectory (trajectory_msgs/JointTrajectory) for "
        "ros2_control's JointTrajectoryController: for robots that take positions only.",
        read_only=True,
    )

    def __post_init__(self) -> None:
        check(self)


GUARDS = ("state_timeout", "command_timeout", "stall_timeout", "guard_sigma", "position_margin")
"""What guards a motion: a change of it ends one that is going on."""


def changed_guards(before: ControllerSettings, after: ControllerSettings) -> str:
    """Say which guards differ, and how; empty if none does."""
    changes = [
        f"{name} from {getattr(before, name):g} to {getattr(after, name):g}"
        for name in GUARDS
        if getattr(before, name) != getattr(after, name)
    ]
    return ", ".join(changes)
