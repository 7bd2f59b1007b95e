"""How the controller moves the robot and when it stops it."""

from __future__ import annotations

from dataclasses import dataclass

from irlpilco_ros.learning.settings import check, setting


@dataclass(frozen=True)
class ControllerSettings:
    """What of the controller is neither the robot's nor the policy's; can be changed any time."""

    start_position: tuple[float, ...] = setting(
        (),
        "Joint positions at which trials start, in the order of `joints`; set with the policy.",
        unit="rad",
    )
    trial_horizon: int = setting(
        0,
        "Number of decisions in a trial; set with the policy. 0: as `horizon` says.",
        minimum=0,
        maximum=10_000,
    )
    start_tolerance: float = setting(
        0.002,
        "How near to its start position each joint must come.",
        unit="rad",
        minimum=1e-5,
        maximum=0.5,
    )
    start_speed_tolerance: float = setting(
        0.03,
        "How slow each joint must be to be at the start; above the noise of measured speeds.",
        unit="rad/s",
        minimum=1e-4,
        maximum=1.0,
    )
    approach_speed: float = setting(
        0.4,
        "Speed of the fastest joint on the way to the start.",
        unit="rad/s",
        minimum=0.01,
        maximum=4.0,
    )
    approach_acceleration: float = setting(
        2.0,
        "How fast the speed builds up on the way to the start.",
        unit="rad/s^2",
        minimum=0.01,
        maximum=100.0,
    )
    approach_gain: float = setting(
        3.0,
        "Speed per distance near the start; too large a gain overshoots on a slow servo.",
        unit="1/s",
        minimum=0.1,
        maximum=20.0,
    )
    approach_timeout: float = setting(
        60.0,
        "Time after which the way to the start has failed.",
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
    position_margin: float = setting(
        0.05,
        "A joint this near to its limit and moving on stops the robot, as does one beyond it; "
        "negative, for simulation only: joints may lean on their stops, and be that far beyond.",
        unit="rad",
        minimum=-1.0,
        maximum=1.0,
    )
    velocity_controller_output: bool = setting(
        False,
        "Also publish commands on velocity_controller/commands (std_msgs/Float64MultiArray) for "
        "ros2_control's JointGroupVelocityController.",
        read_only=True,
    )

    def __post_init__(self) -> None:
        check(self)
