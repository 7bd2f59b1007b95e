"""Policies: from states to controls, for the robot and for Gaussian beliefs alike."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.policies.base import REGISTRY, Arrays, Policy, register, searchable
from irlpilco_ros.learning.policies.linear import LinearPolicy
from irlpilco_ros.learning.policies.linear_phase import LinearPhasePolicy
from irlpilco_ros.learning.policies.open_loop import OpenLoopPolicy
from irlpilco_ros.learning.policies.rbf import RbfPolicy


def from_arrays(kind: str, arrays: Mapping[str, Any]) -> Policy:
    """Return the policy of a kind from the arrays that its `to_arrays` returned.

    Args:
        kind: A name in the registry.
        arrays: Fields of the policy by name, of the right shapes; integers may be 0-d arrays.

    Raises:
        InvalidSettingError: unknown kind, missing or unknown names, wrong shapes, not finite.
    """
    make = REGISTRY.get(kind)
    wanted = {field.name for field in dataclasses.fields(make)}
    if set(arrays) != wanted:
        missing, unknown = sorted(wanted - set(arrays)), sorted(set(arrays) - wanted)
        raise InvalidSettingError(
            f"a {kind} policy needs {', '.join(sorted(wanted))}; "
            f"missing: {', '.join(missing) or 'none'}; unknown: {', '.join(unknown) or 'none'}"
        )
    policy: Policy = make(**arrays)
    return policy


__all__ = [
    "REGISTRY",
    "Arrays",
    "LinearPhasePolicy",
    "LinearPolicy",
    "OpenLoopPolicy",
    "Policy",
    "RbfPolicy",
    "from_arrays",
    "register",
    "searchable",
]
