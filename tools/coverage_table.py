"""Prints how much of the packages without ROS their own tests cover; fails below the limit."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from coverage import Coverage

LIMIT = 90.0  # [%] of the branches of each package


def main() -> int:
    """Print the table of what `coverage run` measured last; return the exit code."""
    measured = Coverage()
    measured.load()
    report = Path("build/covered.json")
    measured.json_report(outfile=str(report))
    files = json.loads(report.read_text(encoding="utf-8"))["files"]
    code = 0
    print(f"{'covered by their own tests':30s}{'lines':>8s}{'branches':>10s}")
    for package in measured.get_option("run:source"):
        summaries = [
            file["summary"] for name, file in files.items() if Path(name).is_relative_to(package)
        ]
        lines = _percent(summaries, "covered_lines", "num_statements")
        branches = _percent(summaries, "covered_branches", "num_branches")
        print(f"{package:30s}{lines:6.1f} %{branches:8.1f} %")
        if branches < LIMIT:
            print(f"{package}: less than {LIMIT:.0f} % of the branches are covered")
            code = 1
    return code


def _percent(summaries: list[dict[str, int]], covered: str, all_of_them: str) -> float:
    total = sum(summary[all_of_them] for summary in summaries)
    return 100.0 * sum(summary[covered] for summary in summaries) / total if total else 0.0


if __name__ == "__main__":
    sys.exit(main())
