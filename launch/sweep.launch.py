"""The whole sweep: five nodes, one demonstration, seven iterations, and the report.

ros2 launch irlpilco_ros sweep.launch.py
ros2 launch irlpilco_ros sweep.launch.py iterations:=0      # the nodes alone
ros2 launch irlpilco_ros sweep.launch.py simulated:=false demonstration:=recordings/000

The last line is for a real robot, to which the task was shown by hand before. The exit code is 0
when everything was done, else 1, after one sentence that says what was not. Called again it goes on
with the run: so many more iterations; run_directory:=runs/another begins another one. Only this
computer finds the nodes (docs/security.md).
"""

import os
from pathlib import Path

from ament_index_python.packages import get_package_prefix, get_package_share_directory
from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    OpaqueFunction,
    RegisterEventHandler,
    Shutdown,
)
from launch.event_handlers import OnProcessExit
from launch.events.process import ProcessExited
from launch.launch_description_entity import LaunchDescriptionEntity
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from irlpilco_ros.ros.discovery import keep_to_this_host

PACKAGE = "irlpilco_ros"
CONFIG = Path(get_package_share_directory(PACKAGE)) / "config"

PATIENCE = "20"
"""How long a process may take to end in good order before it is told again, and killed [s]."""

ARGUMENTS = {
    "namespace": ("", "Namespace of all nodes, such as /robot."),
    "simulated": ("true", "Whether the robot is baxter_simulator, shown by demonstrator."),
    "robot": (str(CONFIG / "baxter.yaml"), "Parameter file of the robot."),
    "simulator": (
        str(CONFIG / "baxter_lockstep.yaml"),
        "Parameter file of the simulated robot; the default waits for the nodes, "
        "baxter_simulator.yaml runs in real time.",
    ),
    "settings": (str(CONFIG / "sweep.yaml"), "Parameter file of the learner."),
    "run_directory": ("runs/sweep", "Where everything goes; a run that is there goes on."),
    "demonstration": ("", "Bag to learn from; empty: that of the run, else have it shown now."),
    "iterations": ("7", "How many iterations to learn; 0: start the nodes alone."),
}


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments; the rest needs their values."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, (default, description) in ARGUMENTS.items()
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=start)])


def start(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return the nodes and what has them do the sweep.

    Raises:
        RuntimeError: the arguments make no sense; launch prints the sentence and ends with 1.
    """
    keep_to_this_host(os.environ)
    values = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    run = Path(values["run_directory"]).resolve()
    check(values, run)
    started = nodes(values, run)
    if int(values["iterations"]) == 0:
        return list(started)
    steps = sweep(values)
    return [*started, steps, *(ended(action, steps) for action in (*started, steps))]


def check(values: dict[str, str], run: Path) -> None:
    """Refuse what would fail later, or be taken for something else."""
    simulated, iterations = values["simulated"], values["iterations"]
    if simulated not in ("true", "false"):
        raise RuntimeError(f"simulated is {simulated!r}; expected true or false")
    if not iterations.isdecimal():
        raise RuntimeError(f"iterations is {iterations!r}; expected a whole number, at least 0")
    is_shown = values["demonstration"] or (run / "demonstration").is_dir()
    if simulated == "false" and int(iterations) > 0 and not is_shown:
        raise RuntimeError(
            "a real robot has to be shown the task before: record it (iterations:=0 starts the "
            "nodes alone), and name its bag with demonstration:="
        )


def nodes(values: dict[str, str], run: Path) -> list[Node]:
    """Return the five nodes, or the three that a real robot needs."""
    learner = {"run_directory": str(run)}
    if values["demonstration"]:  # launch cannot hand over an empty text
        learner["demonstration"] = str(Path(values["demonstration"]).resolve())
    parameters: dict[str, list[str | dict[str, str]]] = {
        "demonstration_recorder": [{"output_directory": str(run / "recordings")}],
        "controller": [],
        "learner": [values["settings"], learner],
    }
    if values["simulated"] == "true":
        parameters |= {"baxter_simulator": [values["simulator"]], "demonstrator": []}
    return [
        Node(
            package=PACKAGE,
            executable=name,
            namespace=values["namespace"],
            parameters=[values["robot"], *own],
            output="screen",
            sigterm_timeout=PATIENCE,
        )
        for name, own in parameters.items()
    ]


def sweep(values: dict[str, str]) -> ExecuteProcess:
    """Return the process that waits for the nodes and has them do one step after the other."""
    program = Path(get_package_prefix(PACKAGE)) / "lib" / PACKAGE / "irlpilco"
    options = ["--iterations", values["iterations"]]
    if values["namespace"]:
        options += ["--namespace", values["namespace"]]
    return ExecuteProcess(
        cmd=[str(program), "sweep", *options], output="screen", sigterm_timeout=PATIENCE
    )


def ended(action: ExecuteProcess, steps: ExecuteProcess) -> RegisterEventHandler:
    """Return what ends the launch with this process: exit code 0 only after the last step.

    Raises:
        RuntimeError: (from the handler) it ended too soon or without success; launch prints the
            sentence, stops the nodes, and ends with exit code 1.
    """

    def end(event: ProcessExited, context: LaunchContext) -> Shutdown | None:
        if context.is_shutdown:  # it was told to end
            return None
        if action is steps and event.returncode == 0:
            return Shutdown(reason="the sweep is learned")
        name = "the sweep" if action is steps else f"the node {event.process_name}"
        raise RuntimeError(
            f"{name} ended with exit code {event.returncode}: see what it says above"
        )

    return RegisterEventHandler(OnProcessExit(target_action=action, on_exit=end))
