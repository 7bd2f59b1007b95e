from __future__ import annotations

from pathlib import Path

import pytest
from jinja2 import UndefinedError

from irlpilco_ros.report.templating import render


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    folder = tmp_path / "pages_of_a_test" / "templates"
    folder.mkdir(parents=True)
    (folder.parent / "__init__.py").touch()
    for name in ("page.html", "page.md"):
        (folder / name).write_text("{{ name | twice }}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    return "pages_of_a_test"


def test_html_is_escaped_and_markdown_is_not(package: str) -> None:
    filters = {"twice": lambda text: text + text}
    assert render(package, "page.html", filters, name="<b>") == "&lt;b&gt;&lt;b&gt;\n"
    assert render(package, "page.md", filters, name="<b>") == "<b><b>\n"


def test_a_name_that_nobody_gave_is_an_error(package: str) -> None:
    with pytest.raises(UndefinedError, match="name"):
        render(package, "page.html", {"twice": lambda text: text + text})
