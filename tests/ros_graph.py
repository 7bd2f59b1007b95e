"""A ROS graph for tests: own domain, nodes as processes of their own, waiting with deadlines.

def test_it(ros):                                       # fixture of conftest.py
    ros.start("irlpilco_ros.nodes.controller", parameters={"horizon": 4},
              files=["config/baxter.yaml"])             # waits until it is on the graph
    states = ros.publisher(JointState, "joint_states", JOINT_STATES_PUB)
    commands = ros.listen(JointState, "joint_command", JOINT_COMMAND)
    assert ros.trigger("controller/stop").success
    ros.wait_for(lambda: commands.messages, "a command")
                                                        # at the end: SIGINT, exit code 0
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import rclpy
import yaml
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.parameter import Parameter, parameter_value_to_python
from std_srvs.srv import Trigger

from irlpilco_ros.ros.discovery import keep_to_this_host
from irlpilco_ros.ros.runtime import LEAVING

REPOSITORY = Path(__file__).resolve().parent.parent
# Nodes of services that do not bear their node's name.
_SERVED_BY = {"learn_iteration": "learner"}
# Domains above 101 use ports that Linux hands out to anybody.
_DOMAINS = range(1, 101)

PATIENCE = 60.0
"""How long something may take that takes a moment on an idle computer [s]."""


class NodeProcess:
    """A node in a process group of its own, its output in a file."""

    def __init__(self, command: Sequence[str], environment: Mapping[str, str], log: Path) -> None:
        self.log = log
        self.expected_code: int | None = 0
        self.command = " ".join(command)
        with log.open("wb") as output:
            self.popen = subprocess.Popen(
                command,
                env=dict(environment),
                cwd=REPOSITORY,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    @property
    def output(self) -> str:
        """All it printed so far, standard error included."""
        return self.log.read_text(encoding="utf-8", errors="replace")

    @property
    def is_alive(self) -> bool:
        return self.popen.poll() is None

    @property
    def was_kept(self) -> bool:
        """Whether the middleware did not let it go in time (see runtime.py): no fault of ours."""
        output = self.output
        return f"Timeout (0:00:{LEAVING:02.0f})!" in output and "in destroy_node" in output

    def send(self, number: int) -> None:
        """Send a signal to its whole process group."""
        if self.is_alive:
            os.killpg(self.popen.pid, number)

    def wait(self, timeout: float = PATIENCE) -> int:
        """Wait for its end and return the exit code; kills it if it takes longer."""
        try:
            return self.popen.wait(timeout)
        except subprocess.TimeoutExpired:
            self.send(signal.SIGKILL)
            self.popen.wait()
            raise AssertionError(
                f"{self.command} did not end within {timeout} s; it printed:\n{self.output}"
            ) from None

    def stop(self, number: int = signal.SIGINT) -> int:
        """Ask it to end, and return the exit code."""
        self.send(number)
        return self.wait()

    def kill(self) -> None:
        """Kill -9: no chance to clean up."""
        self.expected_code = None
        self.send(signal.SIGKILL)
        self.popen.wait()


class Listener:
    """What came in on a topic: messages, and when each arrived on the steady clock [s]."""

    def __init__(self) -> None:
        self.messages: list[Any] = []
        self.arrivals: list[float] = []

    def take(self, message: Any) -> None:
        self.arrivals.append(time.monotonic())
        self.messages.append(message)

    def clear(self) -> None:
        self.messages.clear()
        self.arrivals.clear()


class RosGraph:
    """A domain of its own, a node of the test in it (`.node`), and the processes it started."""

    def __init__(self, folder: Path) -> None:
        """Keep the processes' output in this folder."""
        self.folder = folder
        self._lock, self.domain = _free_domain()
        # Read from the environment when a context is made, here and in the processes.
        keep_to_this_host(os.environ)
        self.environment = {**os.environ, "ROS_DOMAIN_ID": str(self.domain)}
        self.environment["ROS_LOG_DIR"] = str(folder / "ros_log")
        self.environment["OPENBLAS_NUM_THREADS"] = "1"
        path = self.environment.get("PYTHONPATH")
        self.environment["PYTHONPATH"] = f"{REPOSITORY}{os.pathsep + path if path else ''}"
        self.processes: list[NodeProcess] = []
        self._clients: dict[tuple[type, str], Any] = {}

    def __enter__(self) -> RosGraph:
        os.environ.setdefault("ROS_LOG_DIR", self.environment["ROS_LOG_DIR"])
        self.context = Context()
        rclpy.init(context=self.context, domain_id=self.domain)
        self.node = rclpy.create_node(f"test_{os.getpid()}", context=self.context)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self._spinner = threading.Thread(target=self._spin, daemon=True)
        self._spinner.start()
        return self

    def __exit__(self, kind: type | None, *_: object) -> None:
        for process in self.processes:
            process.send(signal.SIGINT)
        wrong = []
        for process in self.processes:
            try:
                code = process.wait()
            except AssertionError as error:
                wrong.append(str(error))
                continue
            if process.was_kept:
                warnings.warn(f"the middleware kept {process.command}", stacklevel=1)
            elif process.expected_code is not None and code != process.expected_code:
                wrong.append(f"{process.command} ended with {code}:\n{process.output}")
        self._executor.shutdown(timeout_sec=5.0)
        self._spinner.join(5.0)
        self.node.destroy_node()
        self.context.try_shutdown()
        self._lock.close()
        if kind is not None:
            for process in self.processes:
                print(f"---- {process.command}\n{process.output}")
        else:
            assert not wrong, "\n".join(wrong)

    def start(
        self,
        module: str,
        *arguments: str,
        parameters: Mapping[str, Any] | None = None,
        files: Sequence[str | Path] = (),
        namespace: str = "",
        node_name: str | None = None,
        wait: bool = True,
    ) -> NodeProcess:
        """Start `python -m MODULE --ros-args ...`; by default wait until it is on the graph.

        Args:
            module: Python module of the node; its name is the module's last part unless
                `node_name` says otherwise (`_node` at its end is left out).
            *arguments: More words after --ros-args.
            parameters: ROS parameters.
            files: Parameter files; relative paths from the repository's top.
            namespace: Such as "/robot".
            node_name: Name to wait for.
            wait: False to return at once.
        """
        name = node_name or module.rsplit(".", 1)[-1].removesuffix("_node")
        command = [sys.executable, "-m", module, "--ros-args", *arguments]
        for file in [*files, *self._parameters_file(name, parameters or {})]:
            command += ["--params-file", str(REPOSITORY / file)]
        if namespace:
            command += ["-r", f"__ns:={namespace}"]
        process = self.run(command, log=f"{module.rsplit('.', 1)[-1]}_{len(self.processes)}.log")
        if wait:
            self.wait_for_node(name, process)
        return process

    def run(self, command: Sequence[str], log: str = "process.log") -> NodeProcess:
        """Start any command in this domain."""
        process = NodeProcess(command, self.environment, self.folder / log)
        self.processes.append(process)
        return process

    def wait_for_node(
        self, name: str, process: NodeProcess | None = None, timeout: float = PATIENCE
    ) -> None:
        """Wait until a node of this name is on the graph."""

        def is_there() -> bool:
            if process is not None and not process.is_alive:
                raise AssertionError(f"{name} ended at its start; it printed:\n{process.output}")
            # Names of services are known before names of nodes.
            services = self.node.get_service_names_and_types()
            return any(service.endswith(f"/{name}/get_parameters") for service, _ in services)

        self.wait_for(is_there, f"node {name}", timeout)

    def wait_until_gone(self, name: str) -> None:
        """Wait until no service of a node that was stopped is found, so that no call goes to it."""
        called = [client for (_, service), client in self._clients.items() if f"{name}/" in service]
        self.wait_for(
            lambda: not any(client.service_is_ready() for client in called),
            f"node {name} to be gone",
        )

    def wait_for(self, condition: Callable[[], Any], what: str, timeout: float = PATIENCE) -> Any:
        """Poll until the condition holds and return its value; fail at the deadline [s]."""
        deadline = time.monotonic() + timeout
        while True:
            value = condition()
            if value:
                return value
            assert time.monotonic() < deadline, f"waited {timeout} s in vain for {what}"
            time.sleep(0.01)

    def listen(
        self, message_type: type, topic: str, qos: Any = 10, publishers: int = 0
    ) -> Listener:
        """Subscribe to a topic and, if asked, wait until so many publishers are on the graph.

        A publisher may learn of this subscription a little later still.
        """
        listener = Listener()
        subscription = self.node.create_subscription(message_type, topic, listener.take, qos)
        self.wait_for(
            lambda: self.node.count_publishers(subscription.topic_name) >= publishers,
            f"{publishers} publishers of {topic}",
        )
        return listener

    def publisher(self, message_type: type, topic: str, qos: Any = 10, subscribers: int = 0) -> Any:
        """Make a publisher and, if asked, wait until so many subscribers are matched."""
        publisher = self.node.create_publisher(message_type, topic, qos)
        self.wait_for(
            lambda: publisher.get_subscription_count() >= subscribers,
            f"{subscribers} subscribers of {topic}",
        )
        return publisher

    def call_async(
        self, service_type: type, name: str, request: Any, wait: float = PATIENCE
    ) -> Any:
        """Call a service; return the future (`.done()`, `.result()`)."""
        key, is_new = (service_type, name), (service_type, name) not in self._clients
        if is_new:
            self._clients[key] = self.node.create_client(service_type, name)
        client = self._clients[key]
        assert client.wait_for_service(wait), f"service {name} is not there"
        if is_new:
            space, _, last = name.strip("/").rpartition("/")
            self._meet(f"{space}/{_SERVED_BY[last]}" if last in _SERVED_BY else space)
        return client.call_async(request)

    def _meet(self, node_name: str) -> None:
        """Wait until a node knows of all clients made so far, so that no answer is lost.

        It learns of them in the order in which they are made: whoever answers through the last
        one answers through all.
        """
        name = f"/{node_name.strip('/')}/get_parameters"
        if name not in dict(self.node.get_service_names_and_types()):
            return  # a service of a test's own
        probe = self.node.create_client(GetParameters, name)
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            if not probe.wait_for_service(1.0):
                continue
            answer, end = probe.call_async(GetParameters.Request()), time.monotonic() + 1.0
            while not answer.done() and time.monotonic() < end:
                time.sleep(0.005)
            if answer.done():
                break
        self.node.destroy_client(probe)

    def call(self, service_type: type, name: str, request: Any, timeout: float = PATIENCE) -> Any:
        """Call a service and return its answer."""
        answer = self.call_async(service_type, name, request)
        self.wait_for(answer.done, f"an answer of {name}", timeout)
        return answer.result()

    def trigger(self, name: str, timeout: float = PATIENCE) -> Trigger.Response:
        """Call a std_srvs/Trigger and return its answer (.success, .message)."""
        return self.call(Trigger, name, Trigger.Request(), timeout)

    def trigger_async(self, name: str) -> Any:
        """Call a std_srvs/Trigger and return the future."""
        return self.call_async(Trigger, name, Trigger.Request())

    def set_parameters(self, node_name: str, values: Mapping[str, Any]) -> SetParametersResult:
        """Set parameters all or nothing; return the node's answer (.successful, .reason)."""
        request = SetParametersAtomically.Request()
        request.parameters = [
            Parameter(name, value=_plain(value)).to_parameter_msg()
            for name, value in values.items()
        ]
        name = f"{node_name}/set_parameters_atomically"
        return self.call(SetParametersAtomically, name, request).result

    def get_parameter(self, node_name: str, name: str) -> Any:
        """Return the value of a node's parameter."""
        request = GetParameters.Request(names=[name])
        answer = self.call(GetParameters, f"{node_name}/get_parameters", request)
        return parameter_value_to_python(answer.values[0])

    def _parameters_file(self, name: str, parameters: Mapping[str, Any]) -> list[Path]:
        """Write parameters for a node of this name.

        Given by `-p` they would lose against what a file says of this very node.
        """
        if not parameters:
            return []
        path = self.folder / f"{name}_{len(self.processes)}.yaml"
        plain = {key: _plain(value) for key, value in parameters.items()}
        path.write_text(yaml.safe_dump({f"/**/{name}": {"ros__parameters": plain}}))
        return [path]

    def _spin(self) -> None:
        with contextlib.suppress(ExternalShutdownException):
            self._executor.spin()


def _free_domain() -> tuple[IO[str], int]:
    """Lock a domain that no other test on this machine uses, whatever process runs it."""
    first = (os.getpid() * 7) % len(_DOMAINS)
    for offset in range(len(_DOMAINS)):
        domain = _DOMAINS[(first + offset) % len(_DOMAINS)]
        path = Path(tempfile.gettempdir()) / f"irlpilco_ros_domain_{domain}.lock"
        lock = path.open("a")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            lock.close()
            continue
        return lock, domain
    raise RuntimeError("all ROS domains of this machine are in use by other tests")


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        return value.tolist()
    return list(value) if isinstance(value, tuple) else value
