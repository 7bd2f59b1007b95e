"""Builds the documents as a site: `make site`.

    python tools/build_site.py          # writes site/

The pages stay where they are read on any other day. They are collected, with all that they link to,
into build/site, because mkdocs wants them in a folder of their own.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
COLLECTED = ROOT / "build" / "site"
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")

GUIDES = {
    "Use it": ("docs/own_robot.md", "docs/ros2_control.md", "docs/moving_object.md"),
    "What comes out": ("docs/results.md", "docs/cart_pole.md", "docs/learning_core.md"),
    "Safety": ("docs/security.md", "docs/reliability.md"),
    "Reference": ("docs/glossary.md", "CHANGELOG.md", "CONTRIBUTING.md", "QUALITY_DECLARATION.md"),
}
"""The pages in the order in which they are offered, by the heading above them."""

INTERFACES = "msgs_docs/README.md"


def links(page: str) -> list[str]:
    """Return what a page links to in this project, as paths from its root, in order."""
    text = (ROOT / page).read_text(encoding="utf-8")
    found = [link for link in LINK.findall(text) if not re.match(r"\w+:", link)]
    return [
        (ROOT / page).parent.joinpath(link).resolve().relative_to(ROOT).as_posix() for link in found
    ]


def reached(page: str = "README.md") -> list[str]:
    """Return a page and all that can be reached from it, as paths from the root."""
    found, waiting = [], [page, *(each for pages in GUIDES.values() for each in pages)]
    while waiting:
        path = waiting.pop(0)
        if path in found or not (ROOT / path).is_file():
            continue
        found.append(path)
        waiting += links(path) if path.endswith(".md") else []
    return found


def navigation() -> list[object]:
    """Return the site's navigation; the interfaces stand as in their own index."""
    pages = [path for path in dict.fromkeys(links(INTERFACES)) if path.endswith(".md")]
    guides = [{title: list(paths)} for title, paths in GUIDES.items()]
    return ["README.md", *guides, {"Interfaces": [INTERFACES, *pages]}]


def collect(folder: Path) -> Path:
    """Copy the pages and what they link to; return the configuration of the site.

    Args:
        folder: What is in it is replaced.
    """
    shutil.rmtree(folder, ignore_errors=True)
    for path in reached():
        copy = folder / "pages" / path
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / path, copy)
    configuration = folder / "mkdocs.yml"
    own = {"INHERIT": str(ROOT / "mkdocs.yml"), "docs_dir": "pages", "nav": navigation()}
    configuration.write_text(json.dumps(own, indent=2), encoding="utf-8")  # JSON is YAML
    return configuration


def main() -> int:
    """Collect and build; return the exit code."""
    configuration = collect(COLLECTED)
    site = ROOT / "site"
    build = ["mkdocs", "build", "--strict", "--quiet", "--config-file", str(configuration)]
    quiet = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}  # of what may come after this version
    command = [sys.executable, "-m", *build, "--site-dir", str(site)]
    code = subprocess.run(command, env=quiet, check=False).returncode
    if code == 0:
        print(f"site: {site / 'index.html'}; its search needs `python3 -m http.server -d site`")
    return code


if __name__ == "__main__":
    sys.exit(main())
