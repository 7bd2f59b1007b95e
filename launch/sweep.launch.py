"""The whole sweep: five nodes, one demonstration, seven iterations, and the report.

ros2 launch irlpilco_ros sweep.launch.py
ros2 launch irlpilco_ros sweep.launch.py iterations:=0      # the nodes alone
ros2 launch irlpilco_ros sweep.launch.py simulated:=false demonstration:=bags/sweep/000

The last line is for a real robot, to which the task was shown by hand before.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    OpaqueFunction,
    RegisterEventHandler,
    Shutdown,
)
from launch.event_handlers import OnProcessExit
from launch.launch_description_entity import LaunchDescriptionEntity
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

PACKAGE = "irlpilco_ros"
CONFIG = Path(get_package_share_directory(PACKAGE)) / "config"

ARGUMENTS = {
    "namespace": ("", "Namespace of all nodes, such as /robot."),
    "simulated": ("true", "Whether the robot is baxter_simulator, shown by demonstrator."),
    "robot": (str(CONFIG / "baxter.yaml"), "Parameter file of the robot."),
    "simulator": (str(CONFIG / "baxter_simulator.yaml"), "Parameter file of the simulated robot."),
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
    """Return the nodes and, after them, the steps of the sweep."""
    values = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    run = Path(values["run_directory"]).resolve()
    started: list[LaunchDescriptionEntity] = list(nodes(values, run))
    if int(values["iterations"]) > 0:
        started += in_turn([*teach(values, run), *learn(values, run)])
    return started


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
        )
        for name, own in parameters.items()
    ]


def teach(values: dict[str, str], run: Path) -> list[ExecuteProcess]:
    """Return the steps by which the demonstrator shows the sweep, unless there is a recording."""
    is_shown = values["demonstration"] or (run / "demonstration").is_dir()
    if is_shown or values["simulated"] != "true":
        return []
    namespace = values["namespace"]
    recordings = run / "recordings"
    bag = recordings / f"{len(list(recordings.glob('*'))):03d}"
    services = (
        "demonstrator/move_to_start",
        "demonstration_recorder/start",
        "demonstrator/play",
        "demonstration_recorder/stop",
    )
    calls = [
        step("ros2", "service", "call", f"{namespace}/{service}", "std_srvs/srv/Trigger")
        for service in services
    ]
    return [
        *calls,
        step("ros2", "param", "set", f"{namespace}/learner", "demonstration", str(bag)),
    ]


def learn(values: dict[str, str], run: Path) -> list[ExecuteProcess]:
    """Return the steps that learn from the demonstration and make the report."""
    irlpilco = ("ros2", "run", PACKAGE, "irlpilco")
    options = ["--iterations", values["iterations"]]
    if values["namespace"]:
        options += ["--namespace", values["namespace"]]
    return [step(*irlpilco, "learn", *options), step(*irlpilco, "report", str(run))]


def step(*command: str) -> ExecuteProcess:
    """Return a command whose output is shown."""
    return ExecuteProcess(cmd=list(command), output="screen")


def in_turn(steps: list[ExecuteProcess]) -> list[LaunchDescriptionEntity]:
    """Run one step after the other; shut down after the last, or when one fails."""
    handlers = []
    for number, done in enumerate(steps):
        following = steps[number + 1 : number + 2] or [Shutdown(reason="the sweep is learned")]

        def go_on(event, _context, following=following):  # type: ignore[no-untyped-def]
            failed = event.returncode != 0
            return [Shutdown(reason="a step failed")] if failed else following

        handlers.append(RegisterEventHandler(OnProcessExit(target_action=done, on_exit=go_on)))
    return [*handlers, steps[0]]
