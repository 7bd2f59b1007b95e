"""Plots, pictures and the HTML report of a run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path


def build_report(
    run_directory: Path | str,
    progress: Callable[[str, float], None] | None = None,
    command: str = "",
) -> Path:
    """Write the report of a run; see `irlpilco_ros.report.build`."""
    # Imported here: the processes that simulate import this package too, and need no plots.
    from irlpilco_ros.report.build import build_report as build

    return build(run_directory, progress, command)


__all__ = ["build_report"]
