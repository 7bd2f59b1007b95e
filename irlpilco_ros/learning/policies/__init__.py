"""Policies: from states to controls, for the robot and for Gaussian beliefs alike."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.policies.base import Arrays, Policy
from irlpilco_ros.learning.policies.linear import LinearPolicy
from irlpilco_ros.learning.policies.linear_phase import LinearPhasePolicy
from irlpilco_ros.learning.policies.open_loop import OpenLoopPolicy
from irlpilco_ros.learning.policies.rbf import RbfPolicy

KINDS: Mapping[str, type[Any]] = {
    "linear": LinearPolicy,
    "linear_phase": LinearPhasePolicy,
    "rbf": RbfPolicy,
    "open_loop": OpenLoopPolicy,
}


def from_arrays(kind: str, arrays: Mapping[str, Any]) -> Policy:
    """Return the policy of a kind from the arrays that its `to_arrays` returned.

    Args:
        kind: One of `KINDS`.
        arrays: Fields of the policy by name, of the right shapes; integers may be 0-d arrays.

    Raises:
        InvalidSettingError: unknown kind, missing or unknown names, wrong shapes, not finite.
    """
    if kind not in KINDS:
        raise InvalidSettingError(
            f"policy kind {kind!r} is unknown; valid kinds: {', '.join(KINDS)}"
        )
    make = KINDS[kind]
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
    "KINDS",
    "Arrays",
    "LinearPhasePolicy",
    "LinearPolicy",
    "OpenLoopPolicy",
    "Policy",
    "RbfPolicy",
    "from_arrays",
]
