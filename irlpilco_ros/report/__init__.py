"""Plots, pictures and the HTML report of a run."""

from irlpilco_ros.report.build import build_report

__all__ = ["build_report"]
