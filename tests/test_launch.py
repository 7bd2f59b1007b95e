"""The launch file, read by stand-ins for the modules of `launch`, which come with apt's ROS only.

The stand-ins write down what the file asks for; the test plays the launch system and lets the
processes end. What they do meanwhile is tested in commands/test_sweep.py.
"""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from irlpilco_ros.cli import build_parser
from irlpilco_ros.experience.parameters_file import load_parameters_file
from irlpilco_ros.ros import discovery


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
        index.get_package_prefix = lambda package: f"/prefix/of/{package}"
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
            stand_in("launch.events.process", "ProcessExited"),
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
    for name in (discovery.RANGE, *discovery.PROFILES):  # put back when the test is over
        monkeypatch.setenv(name, "")
    return Launch(repository / "launch/sweep.launch.py", repository, monkeypatch)


def of(kind: str, actions: list[Recorded]) -> list[Recorded]:
    return [action for action in actions if type(action).__name__ == kind]


def on_end(actions: list[Recorded]) -> dict[str, Callable[..., Any]]:
    """Return what is done when a process ends, by its name."""
    handlers = [handler.args[0] for handler in of("RegisterEventHandler", actions)]
    return {
        getattr(handler.target_action, "executable", "the sweep"): handler.on_exit
        for handler in handlers
    }


def ended(code: int) -> SimpleNamespace:
    return SimpleNamespace(returncode=code, process_name="learner-3")


RUNNING, ENDING = SimpleNamespace(is_shutdown=False), SimpleNamespace(is_shutdown=True)


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


def test_the_simulation_waits_for_nodes_that_a_busy_computer_slows_down(launch):
    nodes = {node.executable: node for node in of("Node", launch.start())}
    _robot, simulation = nodes["baxter_simulator"].parameters
    assert load_parameters_file(simulation, "baxter_simulator") == {"lockstep": True}


def test_one_process_has_the_nodes_do_the_sweep(launch):
    (steps,) = of("ExecuteProcess", launch.start(namespace="/robot", iterations="3"))
    program, *words = steps.cmd
    assert program == "/prefix/of/irlpilco_ros/lib/irlpilco_ros/irlpilco"
    arguments = build_parser().parse_args(words)
    assert (words[0], arguments.iterations, arguments.namespace) == ("sweep", 3, "/robot")


def test_the_last_step_ends_the_launch_with_success(launch):
    actions = launch.start()
    assert of("Shutdown", [on_end(actions)["the sweep"](ended(0), RUNNING)])


@pytest.mark.parametrize(("who", "code"), [("the sweep", 1), ("learner", 1), ("controller", 0)])
def test_what_ends_too_soon_is_said_and_ends_the_launch_with_1(launch, who, code):
    """launch prints the sentence of an exception and makes its own exit code 1."""
    with pytest.raises(RuntimeError, match=f"ended with exit code {code}"):
        on_end(launch.start())[who](ended(code), RUNNING)


def test_every_process_is_watched(launch):
    actions = launch.start()
    nodes = {node.executable for node in of("Node", actions)}
    assert set(on_end(actions)) == {*nodes, "the sweep"}


def test_whoever_is_told_to_end_has_not_failed(launch):
    for end in on_end(launch.start()).values():
        assert end(ended(130), ENDING) is None


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"simulated": "True"}, "expected true or false"),
        ({"iterations": "-1"}, "expected a whole number, at least 0"),
        ({"iterations": "many"}, "expected a whole number, at least 0"),
        ({"simulated": "false"}, "has to be shown the task before"),
    ],
)
def test_arguments_that_make_no_sense_are_a_sentence(launch, given, said):
    with pytest.raises(RuntimeError, match=said):
        launch.start(**given)


def test_a_real_robot_whose_run_has_a_demonstration_learns_on(launch, tmp_path):
    (tmp_path / "runs/sweep/demonstration").mkdir(parents=True)
    assert of("ExecuteProcess", launch.start(simulated="false"))


def test_a_real_robot_needs_three_nodes(launch, tmp_path):
    actions = launch.start(simulated="false", demonstration="recordings/000")
    nodes = {node.executable: node for node in of("Node", actions)}
    assert set(nodes) == {"demonstration_recorder", "controller", "learner"}
    bag = nodes["learner"].parameters[-1]["demonstration"]
    assert bag == str(tmp_path / "recordings/000")


def test_without_iterations_the_nodes_start_alone(launch):
    actions = launch.start(iterations="0")
    assert of("Node", actions) == actions


def test_only_this_host_finds_what_it_starts(launch):
    launch.start()
    assert os.environ[discovery.PROFILES[0]].endswith("config/this_host.xml")
