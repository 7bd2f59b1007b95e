"""`make site`: what is collected for it is whole. mkdocs itself, with --strict, is not run here."""

from __future__ import annotations

import importlib.util
import json
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def tool() -> ModuleType:
    spec = importlib.util.spec_from_file_location("build_site", ROOT / "tools/build_site.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def flat(node: Any) -> list[str]:
    """Return the pages of a navigation."""
    if isinstance(node, str):
        return [node]
    parts = node if isinstance(node, list) else node.values()
    return [page for part in parts for page in flat(part)]


def test_every_guide_and_interface_is_offered_once(tool: ModuleType) -> None:
    pages = flat(tool.navigation())
    assert pages[0] == "README.md"
    assert len(pages) == len(set(pages))
    written = {
        path.relative_to(ROOT).as_posix()
        for folder in ("docs", "msgs_docs")
        for path in (ROOT / folder).glob("*.md")
    }
    assert written | {"README.md", "CHANGELOG.md", "CONTRIBUTING.md"} <= set(pages)


def test_what_is_collected_has_all_that_it_links_to(tool: ModuleType, tmp_path: Path) -> None:
    old = tmp_path / "site" / "pages" / "gone.md"
    old.parent.mkdir(parents=True)
    old.touch()
    configuration = json.loads(tool.collect(tmp_path / "site").read_text(encoding="utf-8"))
    pages = tmp_path / "site" / configuration["docs_dir"]
    assert not old.exists()
    assert (pages / "docs/images/view.webp").is_file()
    for page in pages.rglob("*.md"):
        for link in re.findall(r"\]\(([^)#\s:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            assert (page.parent / link).exists(), f"{page.relative_to(pages)}: {link}"
    assert all((pages / page).is_file() for page in flat(configuration["nav"]))


def test_the_site_loads_nothing_from_elsewhere_and_is_not_kept_in_git() -> None:
    theme = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))["theme"]
    assert theme["name"] == "material"
    assert theme["font"] is False
    assert "/site/" in (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines()
    lock = (ROOT / "requirements/site.lock").read_text(encoding="utf-8")
    assert re.search(r"^mkdocs-material==", lock, re.MULTILINE)
    assert "mermaid" not in "".join(
        path.read_text(encoding="utf-8") for path in (ROOT / "docs").glob("*.md")
    ), "its script would come from elsewhere"
