"""Names that parameters had before, readable for one more release."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any

_LOGGER = logging.getLogger(__name__)

RENAMED: Mapping[str, str] = {
    "method": "imitation",
    "covariance": "covariance_approximation",
    "race": "screening_evaluations",
    "stages": "horizon_stages",
    "phase_count": "linear_phase.count",
    "rbf_count": "rbf.count",
    "variance_weight": "feature_matching.variance_weight",
    "passive_joints": "unactuated_joints",
    "turning_joints": "continuous_joints",
    "policy.passive_joints": "policy.unactuated_joints",
    "policy.turning_joints": "policy.continuous_joints",
    "policy.velocity_limit": "policy.control_limit",
}
"""Old name -> the name it has now."""

_told: set[str] = set()  # of this process: a folder of old policy files is one warning


def under_new_names(values: Mapping[str, Any], where: str = "") -> dict[str, Any]:
    """Return values by the names that they have now; given under both, the new name counts.

    Args:
        values: Flat, by name.
        where: What they come from, such as a file; its old names are then warned of, each once.
    """
    renamed = {name: values[name] for name in values if name not in RENAMED}
    for old in (name for name in values if name in RENAMED):
        renamed.setdefault(RENAMED[old], values[old])
        if where and old not in _told:
            _told.add(old)
            _LOGGER.warning("%s: %s", where, advice(old))
    return renamed


def advice(old: str) -> str:
    """Return a sentence that tells the new name of a parameter."""
    return f"{old} is called {RENAMED[old]} now; files may use the old name for one more release"
