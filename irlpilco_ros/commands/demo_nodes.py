"""The five nodes of the demo: which they are and what they are told."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import irlpilco_ros
from irlpilco_ros.commands.node_processes import NodeProcesses
from irlpilco_ros.commands.number_options import as_set
from irlpilco_ros.commands.settings_files import MISCALIBRATED, settings_paths
from irlpilco_ros.control.controller_settings import ControllerSettings
from irlpilco_ros.experience.robot_settings import RobotSettings
from sim_bridge.simulation_settings import SimulationSettings

SERVICES = {
    "baxter_simulator": ("baxter_simulator/reset",),
    "demonstrator": ("demonstrator/move_to_start", "demonstrator/play"),
    "demonstration_recorder": ("demonstration_recorder/start", "demonstration_recorder/stop"),
    "controller": ("controller/move_to_start", "controller/run_trial"),
    "learner": ("learn_iteration",),
}
"""What is called of each node."""

START_TIMEOUT = 60.0
"""How long the nodes may take to come up [s]."""


def add_robot_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the simulated robot."""
    group = parser.add_argument_group("simulated robot")
    group.add_argument(
        "--preset",
        choices=("default", "compliant", "stiff", "delayed"),
        default="default",
        help="servos: compliant, soft and 50 ms late (default); stiff, doing what they are told; "
        "delayed, 0.4 s behind like a real Baxter's",
    )
    group.add_argument(
        "--motion",
        default="",
        metavar="FILE",
        help="what is shown: YAML file of a motion, or sweep_by_hand (default) or cornered_sweep",
    )
    group.add_argument(
        "--control-period",
        type=as_set(RobotSettings, "control_period"),
        metavar="S",
        help="time between two decisions of the policy [s] (default: that of the settings)",
    )
    group.add_argument(
        "--speed-factor",
        type=as_set(SimulationSettings, "speed_factor"),
        nargs="+",
        metavar="X",
        help="what each joint makes of a commanded 1 rad/s: one number, or 14, left arm first",
    )
    group.add_argument(
        "--command-lag",
        type=as_set(SimulationSettings, "command_lag"),
        metavar="S",
        help="delay of commands [s] (default: preset's)",
    )
    group.add_argument(
        "--position-margin",
        type=as_set(ControllerSettings, "position_margin"),
        metavar="RAD",
        help="a joint this near to its limit stops the robot (default: 0.05); negative lets joints "
        "lean on their stops, which the thesis's random first policy needs",
    )
    group.add_argument(
        "--real-time-factor",
        type=as_set(SimulationSettings, "real_time_factor"),
        metavar="X",
        help="simulated seconds per second, 1 for real time; without it the simulation waits for "
        "each answer (lockstep): as fast as possible, and the same seed gives the same trials",
    )


def node_environment(run_directory: Path) -> dict[str, str]:
    """Return the nodes' environment: this one's, able to import this very package."""
    environment = dict(os.environ)
    package_parent = str(Path(irlpilco_ros.__file__).resolve().parents[1])
    paths = [package_parent, *filter(None, [environment.get("PYTHONPATH")])]
    environment["PYTHONPATH"] = os.pathsep.join(paths)
    environment["PYTHONUNBUFFERED"] = "1"
    environment["ROS_LOG_DIR"] = str(run_directory.resolve() / "log" / "ros")
    return environment


def start_nodes(
    processes: NodeProcesses, arguments: argparse.Namespace, run_directory: Path
) -> None:
    """Start the five nodes, each in a process of its own."""
    robot_file, settings_file = (str(path) for path in settings_paths(arguments))
    robot = ["--params-file", robot_file]
    learner = [*robot, "--params-file", settings_file]
    # A parameter file may have a section of its own for the learner; only this outweighs it.
    learner += _values({"learner:seed": arguments.seed, "learner:run_directory": run_directory})
    if arguments.control_period is not None:
        learner += _values({"learner:control_period": arguments.control_period})
    simulator = [*robot, *_values(_simulation_parameters(arguments))]
    shown = _values({"motion_file": arguments.motion} if arguments.motion else {})
    controller = list(robot)
    if arguments.position_margin is not None:
        controller += _values({"position_margin": arguments.position_margin})
    for module, options in (
        ("sim_bridge.baxter_simulator_node", simulator),
        ("sim_bridge.demonstrator_node", [*robot, *shown]),
        ("irlpilco_ros.nodes.demonstration_recorder", robot),
        ("irlpilco_ros.nodes.controller", controller),
        ("irlpilco_ros.nodes.learner", learner),
    ):
        name = module.rpartition(".")[2].removesuffix("_node")
        processes.start(name, module, ["--ros-args", *options])


def check_simulation(arguments: argparse.Namespace) -> None:
    """Check what the simulator will be told, before anything is started.

    Raises:
        InvalidSettingError: it would refuse it, such as speed factors for another number of joints.
    """
    SimulationSettings(**_simulation_parameters(arguments))


def _simulation_parameters(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return what the simulator is told; what nobody asked for keeps its default."""
    values: dict[str, Any] = {
        "seed": arguments.seed,
        "lockstep": arguments.real_time_factor is None,
    }
    if arguments.preset != "default":
        values["preset"] = arguments.preset
    if str(arguments.robot) == MISCALIBRATED:
        values |= _miscalibrated(arguments)
    for name in ("speed_factor", "command_lag", "real_time_factor"):
        if getattr(arguments, name) is not None:
            values[name] = getattr(arguments, name)
    return values


def _miscalibrated(arguments: argparse.Namespace) -> dict[str, object]:
    """Return the simulator's parameters of a robot whose joints are off by unknown factors."""
    from irlpilco_ros.studies.baxter.robots import miscalibrated_robot

    robot = miscalibrated_robot(arguments.seed)
    values: dict[str, object] = {"speed_factor": list(robot.speed_factor)}
    if arguments.preset != "delayed":
        values["command_lag"] = robot.command_lag
    return values


def _values(parameters: dict[str, object]) -> Sequence[str]:
    """Return parameters as words of a ROS command line."""
    words: list[str] = []
    for name, value in parameters.items():
        text = str(value).lower() if isinstance(value, bool) else str(value)
        words += ["-p", f"{name}:={text}"]
    return words
