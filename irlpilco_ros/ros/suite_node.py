"""The node that all nodes here are: each of its parameters is known and has a value.

What `ros2 param` and parameter files do works on it: `dump` and `load`, empty lists, whole numbers
where floats are meant; and what cannot be is refused in a sentence.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Any

from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_service import ParameterService

from irlpilco_ros.experience.renamed import RENAMED, advice
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.ros.context import told_in_words
from irlpilco_ros.ros.known_parameters import meant, unknown_parameters
from irlpilco_ros.ros.parameter_values import as_declared, plain


class SuiteNode(Node):  # type: ignore[misc]
    """A node whose parameters are declared by `declare`, and nothing else."""

    def __init__(self, name: str, own: Collection[str] = ()) -> None:
        """Make the node and look at what it is started with.

        Args:
            name: Its name.
            own: Names of its parameters, for a node that is no part of this package.

        Raises:
            InvalidSettingError: it is started with a parameter that no node has.
            RosStartError: the middleware refuses, for example one that is built without security.
        """
        with told_in_words():
            super().__init__(name, start_parameter_services=False)
        unknown = unknown_parameters(self._parameter_overrides, own)
        if unknown:
            self.destroy_node()
            raise InvalidSettingError(
                f"{name} is started with parameters that no node of irlpilco_ros has: "
                f"{', '.join(unknown)}; msgs_docs/parameters.md lists those that there are"
            )
        self._units: list[frozenset[str]] = []
        self._requests = _Requests(self)

    def given(self, name: str, kind: Parameter.Type) -> Any:
        """Return what the node was started with for a parameter, None if nothing.

        What was given under an old name counts, with a warning.

        Raises:
            InvalidSettingError: the value cannot be meant as this type.
        """
        names = [name, *(old for old, new in RENAMED.items() if new == name)]
        for each in (each for each in names if each in self._parameter_overrides):
            if each != name:
                self.get_logger().warning(advice(each))
            start: Parameter = self._parameter_overrides[each]
            if start.type_ == Parameter.Type.NOT_SET:  # of `[]` ROS says nothing more
                start = Parameter(each, Parameter.Type.BOOL_ARRAY, [])
            return as_declared(start, kind).value
        return None

    def declare(
        self, name: str, kind: Parameter.Type, value: Any, descriptor: ParameterDescriptor
    ) -> None:
        """Declare a parameter with a value, which may be an empty list."""
        # rclpy cannot tell the type of an empty list: first the type, then the value.
        self.declare_parameter(name, kind, ParameterDescriptor(), ignore_override=True)
        super().set_parameters_atomically([Parameter(name, kind, value)])
        self.set_descriptor(name, descriptor)

    def keep_together(self, names: Iterable[str]) -> None:
        """Let these parameters make sense together only: of one request, all or none are set."""
        self._units.append(frozenset(names))

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set parameters, all or nothing; every refusal has a sentence for its reason.

        A parameter that is fixed may be set to the value that it has.
        """
        try:
            changes = [
                each for each in map(self._as_declared, parameter_list) if self._is_change(each)
            ]
        except InvalidSettingError as error:
            return SetParametersResult(successful=False, reason=str(error))
        if not changes:
            return SetParametersResult(successful=True)
        return super().set_parameters_atomically(changes)

    def set_each(self, parameters: Sequence[Parameter]) -> list[SetParametersResult]:
        """Set what can be set of a request, in one go if all of it can.

        Returns:
            A result for each; those that are kept together share theirs.
        """
        whole = self.set_parameters_atomically(list(parameters))
        if whole.successful or len(parameters) < 2:
            return [whole] * len(parameters)
        results: dict[str, SetParametersResult] = {}
        units = [[each for each in parameters if each.name in unit] for unit in self._units]
        together = {each.name for unit in units for each in unit}
        single = [[each] for each in parameters if each.name not in together]
        for unit in [*single, *units]:
            result = self.set_parameters_atomically(unit)
            results |= {each.name: result for each in unit}
        return [results[each.name] for each in parameters]

    def _as_declared(self, parameter: Parameter) -> Parameter:
        name = parameter.name
        if not self.has_parameter(name):
            names = sorted(self.list_parameters([], 0).names)
            hint = meant(name, names) or f"those of {self.get_name()} are: {', '.join(names)}"
            raise InvalidSettingError(f"parameter {name} does not exist; {hint}")
        if parameter.type_ == Parameter.Type.NOT_SET:
            raise InvalidSettingError(f"parameter {name} cannot be deleted")
        descriptor = self.describe_parameter(name)
        meant_as = as_declared(parameter, Parameter.Type(descriptor.type))
        for bounds in (*descriptor.floating_point_range, *descriptor.integer_range):
            if not bounds.from_value <= meant_as.value <= bounds.to_value:
                raise InvalidSettingError(
                    f"parameter {name} is {meant_as.value!r}; expected "
                    f"{descriptor.additional_constraints}"
                )
        return meant_as

    def _is_change(self, parameter: Parameter) -> bool:
        if not self.describe_parameter(parameter.name).read_only:
            return True
        value = plain(self.get_parameter(parameter.name).value)
        if parameter.value == value:
            return False
        raise InvalidSettingError(
            f"parameter {parameter.name} is read-only: it is {value!r} as long as "
            f"{self.get_name()} runs; give {parameter.value!r} to a new one at its start"
        )


class _Requests(ParameterService):  # type: ignore[misc]
    """The services of a node's parameters; no request ends the node."""

    def _set_parameters_callback(
        self, request: SetParameters.Request, response: SetParameters.Response
    ) -> SetParameters.Response:
        try:
            response.results = self._get_node().set_each(_read(request.parameters))
        except InvalidSettingError as error:
            refusal = SetParametersResult(successful=False, reason=str(error))
            response.results = [refusal] * len(request.parameters)
        return response

    def _set_parameters_atomically_callback(
        self, request: SetParametersAtomically.Request, response: SetParametersAtomically.Response
    ) -> SetParametersAtomically.Response:
        try:
            parameters = _read(request.parameters)
            response.result = self._get_node().set_parameters_atomically(parameters)
        except InvalidSettingError as error:
            response.result = SetParametersResult(successful=False, reason=str(error))
        return response


def _read(messages: Sequence[ParameterMessage]) -> list[Parameter]:
    """Return the parameters of a request.

    Raises:
        InvalidSettingError: one is of no type that there is.
    """
    parameters = []
    for message in messages:
        try:
            parameters.append(Parameter.from_parameter_msg(message))
        except (TypeError, ValueError) as error:
            raise InvalidSettingError(
                f"parameter {message.name} has a value of no known type ({message.value.type})"
            ) from error
    return parameters
