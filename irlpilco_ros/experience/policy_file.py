"""A policy as ROS parameters, and as the parameter file that runs it without a learner.

Parameters are flat: `policy.kind`, `policy.joints`, and one per field of the policy; matrices are
written row by row. The controller checks them with `policy_from_parameters`, all or nothing.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.experience.parameters_file import load_parameters_file
from irlpilco_ros.learning import policies
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.policies import Policy
from irlpilco_ros.learning.policies.declaration import Declared, declared

_LOGGER = logging.getLogger(__name__)

PREFIX = "policy."
SECTION = "/**/controller"

# Names of joints, by the field of `Joints` that holds them.
JOINT_LISTS = {
    "joints": "names",
    "unactuated_joints": "unactuated",
    "continuous_joints": "continuous",
}


HISTORY = "command_history"
"""Number of its last commands that a policy sees; left out where it is none."""


PREDICTED = (f"{PREFIX}predicted_positions", f"{PREFIX}predicted_deviations")
"""What the model expects of the policy's trial, beside the policy itself (see `PredictedBand`)."""

DEMONSTRATED = f"{PREFIX}demonstrated_positions"
"""What the policy imitates, beside the policy itself (see `Demonstrated`)."""

BESIDE = (*PREDICTED, DEMONSTRATED)
"""Parameters that come with a policy, and do not change what it decides."""


def policy_fields() -> dict[str, Declared]:
    """Return every field that a policy of any kind can have, by the name of its ROS parameter.

    A parameter has one type only: of two kinds of policy that declare a field of the same name
    with different types, the later cannot be run by a controller, which is logged.
    """
    found: dict[str, Declared] = {}
    for kind in policies.REGISTRY.classes():
        for field in declared(kind):
            name = PREFIX + field.name
            known = found.setdefault(name, field)
            if (known.kind, not known.shape) != (field.kind, not field.shape):
                _LOGGER.warning(
                    "a %s policy has a field %s of another type than other policies have, and "
                    "cannot be run by the controller; give the field another name",
                    kind.kind,
                    field.name,
                )
    return found


def policy_to_parameters(policy: Policy, joints: Joints) -> dict[str, Any]:
    """Return a policy as ROS parameters: name -> str, int, float or a list of these.

    Args:
        policy: Its controls are those of the F commanded joints, its state positions and
            velocities of all J, with sine and cosine for the positions of those that turn.
        joints: The joints, in the policy's order.

    Raises:
        InvalidSettingError: the policy does not fit the joints.
    """
    fields = policy.to_arrays()
    lists = {name: list(getattr(joints, field)) for name, field in JOINT_LISTS.items()}
    parameters: dict[str, Any] = {f"{PREFIX}kind": fields.pop("kind")}
    parameters |= {PREFIX + name: names for name, names in lists.items() if names}
    history = _history(policy, joints)
    if history:
        parameters[PREFIX + HISTORY] = history
    for name, value in fields.items():
        parameters[PREFIX + name] = np.asarray(value).ravel().tolist() if np.ndim(value) else value
    return parameters


def policy_from_parameters(parameters: Mapping[str, Any]) -> tuple[Policy, Joints]:
    """Return the policy that ROS parameters describe, and its joints.

    Parameters that do not start with `policy.` are left alone, as is what comes `BESIDE` it.

    Raises:
        InvalidSettingError: unknown kind, missing or unknown parameter, wrong length or type,
            or a number that is not finite; says which.
    """
    fields = {
        name.removeprefix(PREFIX): value
        for name, value in parameters.items()
        if name.startswith(PREFIX) and name not in BESIDE
    }
    absent = [name for name in ("kind", "joints") if not fields.get(name)]
    if absent:
        raise InvalidSettingError(f"parameter {PREFIX}{absent[0]} is missing or empty")
    kind = fields.pop("kind")
    lists = {field: fields.pop(name, ()) for name, field in JOINT_LISTS.items()}
    try:
        joints = Joints(**lists)
    except InvalidSettingError as error:
        raise InvalidSettingError(f"{PREFIX}joints: {error}") from error
    history, controls = fields.pop(HISTORY, 0), len(joints.commanded)
    if type(history) is not int or history < 0:
        raise InvalidSettingError(f"{PREFIX}{HISTORY} is {history!r}; expected a whole number")
    sizes = {"F": controls, "D": joints.policy_size + history * controls}
    try:
        policy = policies.REGISTRY.get(kind).from_lists(fields, sizes)
    except InvalidSettingError as error:
        raise InvalidSettingError(f"{PREFIX}*: {error}") from error
    _history(policy, joints)
    return policy, joints


def write_policy_file(
    path: Path,
    policy: Policy,
    joints: Joints,
    controller_parameters: Mapping[str, Any] | None = None,
) -> None:
    """Write a policy as a ROS parameter file for the controller.

    Args:
        path: Such as RUN/policy_007.yaml; replaced if it exists.
        policy: The policy.
        joints: Its joints, in order.
        controller_parameters: What else the controller needs to run it alone, flat: the robot
            settings, the start position [rad], and what comes `BESIDE` the policy.
    """
    tree: dict[str, Any] = {
        name: _plain(value) for name, value in sorted((controller_parameters or {}).items())
    }
    beside = {name: tree.pop(name) for name in BESIDE if name in tree}
    tree["policy"] = {
        name.removeprefix(PREFIX): value
        for name, value in {**policy_to_parameters(policy, joints), **beside}.items()
    }
    text = yaml.safe_dump(
        {SECTION: {"ros__parameters": tree}}, sort_keys=False, default_flow_style=None, width=100
    )
    header = (
        f"# Run it: ros2 run irlpilco_ros controller --ros-args --params-file {path.name}\n"
        "# Matrices are written row by row.\n"
    )
    write_atomically(path, (header + text).encode())


def read_policy_file(path: Path) -> tuple[Policy, Joints]:
    """Return the policy of a parameter file, and its joints.

    Raises:
        InvalidSettingError: the file cannot be read, or as `policy_from_parameters`.
    """
    try:
        return policy_from_parameters(load_parameters_file(path, "controller"))
    except InvalidSettingError as error:
        raise InvalidSettingError(f"{path}: {error}") from error


def _history(policy: Policy, joints: Joints) -> int:
    """Return how many of its last commands a policy sees beside the state of the joints."""
    controls, states = len(policy.control_limit), policy.state_size
    wanted = (len(joints.commanded), joints.policy_size)
    history, rest = divmod(states - wanted[1], wanted[0])
    if controls != wanted[0] or rest or history < 0:
        raise InvalidSettingError(
            f"a policy with {controls} controls and {states} states does not fit "
            f"{len(joints.names)} joints; expected {wanted[0]} controls and {wanted[1]} states "
            "(positions and velocities, with sine and cosine of a joint that turns), and "
            f"{wanted[0]} more for each command that it remembers"
        )
    return history


def _plain(value: Any) -> Any:
    """Return numpy arrays, numpy numbers and tuples as what YAML knows."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return [_plain(element) for element in value] if isinstance(value, tuple | list) else value
