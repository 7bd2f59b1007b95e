"""A policy as ROS parameters, and as the parameter file that runs it without a learner.

Parameters are flat: `policy.kind`, `policy.joints`, and one per field of the policy; matrices are
written row by row. The controller checks them with `policy_from_parameters`, all or nothing.
"""

from __future__ import annotations

import dataclasses
import typing
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

PREFIX = "policy."
SECTION = "/**/controller"

# What a row of each matrix belongs to; from it and the length follows the shape.
_ROW_PER_CONTROL = ("weights", "phase_weights")
_COLUMN_PER_CONTROL = ("controls", "targets")
_COLUMN_PER_STATE = ("centres", "log_widths")
# Names of joints, by the field of `Joints` that holds them.
_JOINT_LISTS = {
    "joints": "names",
    "unactuated_joints": "unactuated",
    "continuous_joints": "continuous",
}


def parameter_types() -> dict[str, type]:
    """Return every parameter that a policy of any kind can have: name -> str, int, float or list.

    Those of `names_parameters` are lists of names, every other list is one of numbers.
    """
    types: dict[str, type] = {f"{PREFIX}kind": str, **dict.fromkeys(names_parameters(), list)}
    for kind in policies.REGISTRY.classes():
        hints = typing.get_type_hints(kind)
        for field in dataclasses.fields(kind):
            hint = hints[field.name]
            name = PREFIX + field.name
            types[name] = hint if hint in (int, float) else list
    return types


def names_parameters() -> tuple[str, ...]:
    """Return the parameters of a policy that are lists of joint names."""
    return tuple(PREFIX + name for name in _JOINT_LISTS)


def policy_to_parameters(policy: Policy, joints: Joints) -> dict[str, Any]:
    """Return a policy as ROS parameters: name -> str, int, float or a list of these.

    Args:
        policy: Its controls are those of the F commanded joints, its state positions and
            velocities of all J, with sine and cosine for the positions of those that turn.
        joints: The joints, in the policy's order.

    Raises:
        InvalidSettingError: the policy does not fit the joints.
    """
    _check_size(policy, joints)
    parameters: dict[str, Any] = {f"{PREFIX}kind": policy.kind}
    for name, field in _JOINT_LISTS.items():
        if getattr(joints, field):
            parameters[PREFIX + name] = list(getattr(joints, field))
    for name, value in policy.to_arrays().items():
        public = PREFIX + name
        parameters[public] = np.asarray(value).ravel().tolist() if np.ndim(value) else value
    return parameters


def policy_from_parameters(parameters: Mapping[str, Any]) -> tuple[Policy, Joints]:
    """Return the policy that ROS parameters describe, and its joints.

    Parameters that do not start with `policy.` are left alone.

    Raises:
        InvalidSettingError: unknown kind, missing or unknown parameter, wrong length or type,
            or a number that is not finite; says which.
    """
    fields = {
        name.removeprefix(PREFIX): value
        for name, value in parameters.items()
        if name.startswith(PREFIX)
    }
    absent = [name for name in ("kind", "joints") if not fields.get(name)]
    if absent:
        raise InvalidSettingError(f"parameter {PREFIX}{absent[0]} is missing or empty")
    kind = fields.pop("kind")
    lists = {field: fields.pop(name, ()) for name, field in _JOINT_LISTS.items()}
    try:
        joints = Joints(**lists)
    except InvalidSettingError as error:
        raise InvalidSettingError(f"{PREFIX}joints: {error}") from error
    arrays = {name: _shaped(name, value, joints) for name, value in fields.items()}
    policy = policies.from_arrays(kind, arrays)
    _check_size(policy, joints)
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
            settings and the start position [rad].
    """
    tree: dict[str, Any] = {
        name: _plain(value) for name, value in sorted((controller_parameters or {}).items())
    }
    tree["policy"] = {
        name.removeprefix(PREFIX): value
        for name, value in policy_to_parameters(policy, joints).items()
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


def _shaped(name: str, value: Any, joints: Joints) -> Any:
    """Return a list of numbers as an array of its field's shape; numbers as they are."""
    if np.ndim(value) == 0:
        return value
    try:
        flat = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InvalidSettingError(f"{PREFIX}{name} holds something else than numbers") from None
    controls, states = len(joints.commanded), joints.policy_size
    columns = {
        **dict.fromkeys(_ROW_PER_CONTROL, flat.size // controls),
        **dict.fromkeys(_COLUMN_PER_CONTROL, controls),
        **dict.fromkeys(_COLUMN_PER_STATE, states),
    }.get(name)
    if columns is None:
        return flat
    rows = flat.size // columns if columns else 0
    if flat.size == 0 or rows * columns != flat.size:
        raise InvalidSettingError(
            f"{PREFIX}{name} has {flat.size} values, which make no matrix for {controls} joints "
            f"and {states} states"
        )
    return flat.reshape(rows, columns)


def _check_size(policy: Policy, joints: Joints) -> None:
    controls, states = len(policy.control_limit), policy.state_size
    wanted = (len(joints.commanded), joints.policy_size)
    if (controls, states) != wanted:
        raise InvalidSettingError(
            f"a policy with {controls} controls and {states} states does not fit "
            f"{len(joints.names)} joints; expected {wanted[0]} controls and {wanted[1]} states "
            "(positions and velocities, with sine and cosine of a joint that turns)"
        )


def _plain(value: Any) -> Any:
    """Return numpy arrays, numpy numbers and tuples as what YAML knows."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return [_plain(element) for element in value] if isinstance(value, tuple | list) else value
