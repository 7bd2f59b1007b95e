"""Policies: from states to controls, for the robot and for Gaussian states alike.

A policy of another package is offered by an entry point of the group irlpilco_ros.policies.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.policies.acting import check_acts
from irlpilco_ros.learning.policies.base import REGISTRY, Arrays, Policy, check_names
from irlpilco_ros.learning.policies.declaration import control_limit, fixed, number, parameter
from irlpilco_ros.learning.policies.linear import LinearPolicy
from irlpilco_ros.learning.policies.linear_phase import LinearPhasePolicy
from irlpilco_ros.learning.policies.open_loop import OpenLoopPolicy
from irlpilco_ros.learning.policies.rbf import RbfPolicy
from irlpilco_ros.learning.policies.smooth_phase import SmoothPhasePolicy


def searchable() -> tuple[str, ...]:
    """Return the names of the policies that can be learned."""
    return tuple(cls.kind for cls in REGISTRY.classes() if cls.searchable)


def from_arrays(arrays: Mapping[str, Any]) -> Policy:
    """Return the policy from what its `to_arrays` returned.

    Args:
        arrays: `kind`, and the fields of the policy by name, of the right shapes; lists are fine,
            and numbers may be 0-d arrays.

    Raises:
        InvalidSettingError: unknown kind, missing or unknown names, wrong shapes, not finite.
    """
    if "kind" not in arrays:
        raise InvalidSettingError("a policy needs its kind; it is missing")
    cls = REGISTRY.get(str(arrays["kind"]))
    fields = {name: value for name, value in arrays.items() if name != "kind"}
    check_names(cls, fields)
    return cls(**fields)


__all__ = [
    "REGISTRY",
    "Arrays",
    "LinearPhasePolicy",
    "LinearPolicy",
    "OpenLoopPolicy",
    "Policy",
    "RbfPolicy",
    "SmoothPhasePolicy",
    "check_acts",
    "control_limit",
    "fixed",
    "from_arrays",
    "number",
    "parameter",
    "searchable",
]
