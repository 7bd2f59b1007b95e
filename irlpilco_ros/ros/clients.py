"""Calls of other nodes with a time limit and errors that a person can read.

Calls are awaited inside async callbacks, so that the node stays responsive; the command line, where
nobody else spins the node, awaits them in a `Session`.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.client import Client
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.task import Future
from std_srvs.srv import Trigger

from irlpilco_ros.learning.errors import IrlPilcoError

_POLL = 0.05  # [s] between two looks whether a service is there
_LOOK = 0.5  # [s] between two looks whether the one who should answer is still there
_ANSWER = 2.0  # [s] that an answer which costs nothing may take before it is taken for lost


class ServiceError(IrlPilcoError):
    """A service is not there, did not answer in time, or refused."""


class RefusedError(ServiceError):
    """A service answered success=false; the message says why."""


class Clients:
    """The services that one node calls.

    Names are relative, so that remapping the caller's namespace reaches the right nodes.
    """

    def __init__(self, node: Node) -> None:
        """Make calls as this node, in a callback group of their own."""
        self._node = node
        self._group = ReentrantCallbackGroup()
        self._clock = Clock(clock_type=ClockType.STEADY_TIME)
        self._clients: dict[tuple[str, type], Client] = {}

    async def call(
        self, service_type: type, name: str, request: Any, timeout: float, wait: float = 5.0
    ) -> Any:
        """Call a service from an async callback.

        Args:
            service_type: Such as std_srvs.srv.Trigger.
            name: Name of the service.
            request: The request.
            timeout: How long the answer may take [s].
            wait: How long to wait for the service to appear [s].

        Raises:
            ServiceError: the service is not there or does not answer in time.
        """
        client = await self._ready_client(service_type, name, wait)
        answer = client.call_async(request)
        end = time.monotonic() + timeout
        while not answer.done() and (left := end - time.monotonic()) > 0.0:
            await self._first_of(answer, min(left, _LOOK))
            if not answer.done() and not client.service_is_ready():
                client.remove_pending_request(answer)
                raise ServiceError(f"service {name} went away before it answered: its node ended")
        if not answer.done():
            client.remove_pending_request(answer)
            raise ServiceError(_late(name, timeout))
        return answer.result()

    async def meet(self, services: Mapping[str, Sequence[str]], timeout: float) -> None:
        """Wait until nodes are there and know of this one, so that no answer of theirs is lost.

        A service that is there may be so new that its node would not yet know whom to answer.
        Nodes learn of clients in the order in which these are made: whoever answers through the
        last one, which reads no parameter, answers through all.

        Args:
            services: By the name of each node the std_srvs/Trigger services of it that will be
                called; its parameters may be set, too.
            timeout: How long that may take in all [s].

        Raises:
            ServiceError: names the first service that is not there, or the node that is silent.
        """
        end = time.monotonic() + timeout

        def left() -> float:
            return max(end - time.monotonic(), _POLL)

        for node_name, names in services.items():
            for name in names:
                await self._ready_client(Trigger, name, left())
            await self._ready_client(SetParametersAtomically, _setter(node_name), left())
        for node_name in services:
            while True:
                try:
                    await self.get_parameters(node_name, (), min(left(), _ANSWER), left())
                    break
                except ServiceError:
                    if time.monotonic() > end:
                        raise

    async def trigger(self, name: str, timeout: float, wait: float = 5.0) -> str:
        """Call a std_srvs/Trigger and return its message.

        Raises:
            ServiceError: as `call`, or the service answered success=false; the message says why.
        """
        answer = await self.call(Trigger, name, Trigger.Request(), timeout, wait)
        return _message_of(name, answer)

    async def set_parameters(
        self, node_name: str, values: Mapping[str, Any], timeout: float = 5.0, wait: float = 5.0
    ) -> None:
        """Set parameters of another node, all or nothing.

        Raises:
            ServiceError: as `call`, or the node refused; the message says why.
        """
        name, request = _parameters_request(node_name, values)
        answer = await self.call(SetParametersAtomically, name, request, timeout, wait)
        _check_parameters(node_name, answer)

    async def get_parameters(
        self, node_name: str, names: Sequence[str], timeout: float = 5.0, wait: float = 5.0
    ) -> dict[str, Any]:
        """Return parameters of another node by name.

        Raises:
            ServiceError: as `call`, or the node lacks one of them.
        """
        request = GetParameters.Request(names=list(names))
        service = f"{node_name}/get_parameters"
        answer = await self.call(GetParameters, service, request, timeout, wait)
        if len(answer.values) < len(names):
            raise ServiceError(f"{node_name} lacks one of the parameters {', '.join(names)}")
        values = [parameter_value_to_python(value) for value in answer.values]
        return dict(zip(names, values, strict=True))

    async def sleep(self, seconds: float) -> None:
        """Wait inside an async callback, on the steady clock, while others run."""
        await self._first_of(Future(), seconds)

    async def _first_of(self, future: Future, timeout: float) -> None:
        """Return when the future is done or the time [s] is over, whichever comes first."""
        either = Future(executor=self._node.executor)

        def finish(*_: object) -> None:
            if not either.done():
                either.set_result(None)

        timer = self._node.create_timer(
            timeout, finish, callback_group=self._group, clock=self._clock
        )
        future.add_done_callback(finish)
        try:
            await either
        finally:
            self._node.destroy_timer(timer)

    async def _ready_client(self, service_type: type, name: str, wait: float) -> Client:
        client = self._client(service_type, name)
        for _ in range(max(1, round(wait / _POLL))):
            if client.service_is_ready():
                return client
            await self.sleep(_POLL)
        raise ServiceError(_absent(name, wait))

    def _client(self, service_type: type, name: str) -> Client:
        key = (name, service_type)
        if key not in self._clients:
            self._clients[key] = self._node.create_client(
                service_type, name, callback_group=self._group
            )
        return self._clients[key]


def _absent(name: str, wait: float) -> str:
    return (
        f"service {name} is not there (waited {wait:g} s); is its node running, "
        "in the same namespace and ROS_DOMAIN_ID, and on this computer (else: docs/security.md)?"
    )


def _late(name: str, timeout: float) -> str:
    return f"service {name} did not answer within {timeout:g} s; is its node alive?"


def _message_of(name: str, answer: Any) -> str:
    if not answer.success:
        raise RefusedError(f"{name} refused: {answer.message}")
    return str(answer.message)


def _parameters_request(
    node_name: str, values: Mapping[str, Any]
) -> tuple[str, SetParametersAtomically.Request]:
    parameters: list[ParameterMessage] = [
        Parameter(key, value=_plain(value)).to_parameter_msg() for key, value in values.items()
    ]
    request = SetParametersAtomically.Request(parameters=parameters)
    return _setter(node_name), request


def _setter(node_name: str) -> str:
    return f"{node_name}/set_parameters_atomically"


def _plain(value: Any) -> Any:
    """Numpy arrays and tuples as lists, numpy scalars as Python's."""
    if hasattr(value, "tolist"):
        return value.tolist()
    return list(value) if isinstance(value, tuple) else value


def _check_parameters(node_name: str, answer: Any) -> None:
    if not answer.result.successful:
        raise ServiceError(f"{node_name} refused the parameters: {answer.result.reason}")
