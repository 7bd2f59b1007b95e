"""The launch file, read by stand-ins for the modules of `launch`, which come with apt's ROS only.

The stand-ins write down what the file asks for; the test plays the launch system and lets one
step after the other end.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest


class Recorded:
    """Any action of launch: keeps the arguments that it was made with."""

    def __init__(self, *args: object, **kwargs: object) -> None:
        self.args: tuple[Any, ...] = args
        self.__dict__.update(kwargs)

    def __getattr__(self, name: str) -> Any:  # what was given by keyword
        raise AttributeError(name)


def stand_in(name: str, *classes: str) -> ModuleType:
    module = ModuleType(name)
    for cls in classes:
        setattr(module, cls, type(cls, (Recorded,), {}))
    return module


class Launch:
    """The launch system as far as the file needs it."""

    def __init__(self, file: Path, share: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        substitutions: Any = ModuleType("launch.substitutions")
        substitutions.LaunchConfiguration = lambda name: SimpleNamespace(
            perform=lambda context: context[name]
        )
        index: Any = ModuleType("ament_index_python.packages")
        index.get_package_share_directory = lambda _package: str(share)
        for module in (
            stand_in("launch", "LaunchContext", "LaunchDescription"),
            stand_in(
                "launch.actions",
                "DeclareLaunchArgument",
                "ExecuteProcess",
                "OpaqueFunction",
                "RegisterEventHandler",
                "Shutdown",
            ),
            stand_in("launch.event_handlers", "OnProcessExit"),
            stand_in("launch.launch_description_entity", "LaunchDescriptionEntity"),
            stand_in("launch_ros.actions", "Node"),
            substitutions,
            index,
        ):
            monkeypatch.setitem(sys.modules, module.__name__, module)
        spec = importlib.util.spec_from_file_location("sweep_launch", file)
        assert spec is not None
        self.file = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(self.file)

    def start(self, **given: str) -> list[Recorded]:
        """Return what is started with these arguments, the others at their defaults."""
        *arguments, setup = self.file.generate_launch_description().args[0]
        values = {argument.args[0]: argument.default_value for argument in arguments}
        assert set(given) <= set(values)
        return setup.function({**values, **given})


@pytest.fixture
def launch(repository, monkeypatch, tmp_path) -> Launch:
    monkeypatch.chdir(tmp_path)
    return Launch(repository / "launch/sweep.launch.py", repository, monkeypatch)


def of(kind: str, actions: list[Recorded]) -> list[Recorded]:
    return [action for action in actions if type(action).__name__ == kind]


def end_each(actions: list[Recorded], returncode: int = 0) -> list[list[str]]:
    """Let every step end with this code; return the steps in the order in which they ran."""
    handlers = [handler.args[0] for handler in of("RegisterEventHandler", actions)]
    steps = of("ExecuteProcess", actions)
    ran = []
    while steps:
        (step,) = steps
        ran.append(step.cmd)
        (handler,) = [handler for handler in handlers if handler.target_action is step]
        following = handler.on_exit(SimpleNamespace(returncode=returncode), None)
        steps = of("ExecuteProcess", following)
    assert of("Shutdown", following), "the last step ends the launch"
    return ran


def test_five_nodes_start_with_files_that_exist(launch, repository):
    nodes = of("Node", launch.start())
    executables = {path.name for path in (repository / "executables").iterdir()}
    assert {node.executable for node in nodes} == executables - {"irlpilco", "cart_pole_simulator"}
    for node in nodes:
        assert node.package == "irlpilco_ros"
        for parameters in node.parameters:
            assert isinstance(parameters, dict) or Path(parameters).is_file()


def test_no_parameter_is_an_empty_text(launch):
    """launch_ros reads values as YAML, and refuses the nothing that an empty text is."""
    for node in of("Node", launch.start()):
        for parameters in node.parameters:
            assert not isinstance(parameters, dict) or all(parameters.values())


def test_the_sweep_is_shown_recorded_and_learned_in_turn(launch, tmp_path):
    steps = end_each(launch.start(namespace="/robot", iterations="3"))
    assert [step[3] for step in steps[:4]] == [
        "/robot/demonstrator/move_to_start",
        "/robot/demonstration_recorder/start",
        "/robot/demonstrator/play",
        "/robot/demonstration_recorder/stop",
    ]
    run = tmp_path / "runs/sweep"
    assert steps[4][2:] == ["set", "/robot/learner", "demonstration", f"{run}/recordings/000"]
    assert steps[5][4:] == ["learn", "--iterations", "3", "--namespace", "/robot"]
    assert steps[6][4:] == ["report", str(run)]


def test_a_step_that_fails_ends_the_launch(launch):
    assert len(end_each(launch.start(), returncode=1)) == 1


def test_a_run_that_has_a_demonstration_goes_on_with_it(launch, tmp_path):
    (tmp_path / "runs/sweep/demonstration").mkdir(parents=True)
    assert [step[4] for step in end_each(launch.start())] == ["learn", "report"]


def test_a_real_robot_needs_three_nodes_and_a_recorded_demonstration(launch, tmp_path):
    actions = launch.start(simulated="false", demonstration="bags/sweep/000")
    nodes = {node.executable: node for node in of("Node", actions)}
    assert set(nodes) == {"demonstration_recorder", "controller", "learner"}
    bag = nodes["learner"].parameters[-1]["demonstration"]
    assert bag == str(tmp_path / "bags/sweep/000")
    assert [step[4] for step in end_each(actions)] == ["learn", "report"]


def test_without_iterations_the_nodes_start_alone(launch):
    actions = launch.start(iterations="0")
    assert of("Node", actions) == actions


def test_the_commands_of_the_steps_are_understood(launch):
    from irlpilco_ros.cli import build_parser

    for step in end_each(launch.start(namespace="/robot")):
        if "irlpilco" in step:
            build_parser().parse_args(step[step.index("irlpilco") + 1 :])
