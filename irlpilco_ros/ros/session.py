"""The command line as a ROS node: short-lived, calls services, and watches the learner."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Mapping, Sequence
from types import TracebackType
from typing import Any, TypeVar

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from rclpy.exceptions import InvalidNamespaceException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rclpy.validate_namespace import validate_namespace

from irlpilco_ros.ros.clients import Clients
from irlpilco_ros.ros.context import RosStartError, begin, told_in_words
from irlpilco_ros.ros.learner_progress import LearnerProgress, MalformedProgressError
from irlpilco_ros.ros.messages import nanoseconds
from irlpilco_ros.ros.qos import DIAGNOSTICS
from irlpilco_ros.ros.safe_subscription import Info, SafeSubscription

Result = TypeVar("Result")

POLL = 0.1
"""How often something that takes long is looked after [s]."""

FOREVER = 7 * 24 * 3600.0
"""Timeout of a call that may take as long as it needs while its node is there [s]."""


class Session:
    """A node that lives as long as a `with` statement and waits for one thing at a time.

    Attributes:
        node: The node.
        clients: Service calls made as this node.
        progress: What the learner has last said on `learner/progress` since `run` was called, or
            None.
    """

    def __init__(self, name: str, namespace: str = "", remappings: Sequence[str] = ()) -> None:
        """Start the node.

        Args:
            name: Name of the node.
            namespace: Its namespace; the services it calls are in there too.
            remappings: Names that it uses instead of others, each as FROM:=TO.

        Raises:
            RosStartError: ROS cannot begin, or the namespace or a remapping is none.
        """
        namespace = f"/{namespace.strip('/')}"
        try:
            validate_namespace(namespace)
        except InvalidNamespaceException as error:
            raise RosStartError(" ".join(str(error).replace("^", "").split())) from error
        self._context = Context()
        # Ctrl-C must raise KeyboardInterrupt here as in any other command.
        rules = [word for rule in remappings for word in ("-r", rule)]
        begin(["irlpilco", "--ros-args", *rules], self._context)
        with told_in_words():
            self.node = Node(name, namespace=namespace, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self.clients = Clients(self.node)
        self.progress: LearnerProgress | None = None
        self._since = self.node.get_clock().now()
        self._subscription = SafeSubscription(
            self.node, DiagnosticArray, "learner/progress", self._take_progress, DIAGNOSTICS
        )

    def run(
        self, work: Coroutine[Any, Any, Result], on_wait: Callable[[], None] | None = None
    ) -> Result:
        """Run a coroutine to its end and return its result.

        Args:
            work: What to await; it may await rclpy futures only.
            on_wait: Called ten times a second meanwhile; what it raises ends the waiting.
        """
        self.progress, self._since = None, self.node.get_clock().now()
        task = self._executor.create_task(work)
        while not task.done():
            self._executor.spin_once(timeout_sec=POLL)
            if on_wait is not None:
                on_wait()
        result: Result = task.result()
        return result

    def trigger(
        self, service: str, timeout: float | None, on_wait: Callable[[], None] | None = None
    ) -> str:
        """Call a std_srvs/Trigger and return its message.

        Args:
            service: Its name.
            timeout: How long the answer may take [s]; None waits while its node is there.
            on_wait: As in `run`.

        Raises:
            ServiceError: it is not there, does not answer, or refuses; the message says why.
        """
        limit = FOREVER if timeout is None else timeout
        return self.run(self.clients.trigger(service, limit), on_wait)

    def wait_for_nodes(
        self,
        services: Mapping[str, Sequence[str]],
        timeout: float,
        on_wait: Callable[[], None] | None = None,
    ) -> None:
        """Wait until nodes are ready: none of their answers to this node will be lost.

        Args:
            services: By the name of each node the std_srvs/Trigger services of it that will be
                called; its parameters may be set, too.
            timeout: How long that may take in all [s].
            on_wait: As in `run`.

        Raises:
            ServiceError: names the first service that is not there in time, or the node that is
                silent.
        """
        self.run(self.clients.meet(services, timeout), on_wait)

    def _take_progress(self, data: bytes, _: Info) -> None:
        try:
            message = deserialize_message(data, DiagnosticArray)
        except Exception as error:  # whatever rclpy raises for bytes that are no message
            raise MalformedProgressError(f"{len(data)} bytes are no DiagnosticArray") from error
        # Between two calls nobody listens, and what is waiting then is about the last one.
        if nanoseconds(message.header.stamp) >= self._since.nanoseconds:
            self.progress = LearnerProgress.from_message(message) or self.progress

    def __enter__(self) -> Session:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """End the node."""
        self._executor.shutdown(timeout_sec=1.0)
        self.node.destroy_node()
        self._context.try_shutdown()
