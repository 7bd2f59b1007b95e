"""Tables in a document that people write: replaced between markers, the text around them kept."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from irlpilco_ros.learning.errors import InvalidSettingError


def fill_tables(document: Path, tables: Mapping[str, str]) -> None:
    """Replace what is between `<!-- table: NAME -->` and `<!-- end -->`.

    Raises:
        InvalidSettingError: the document has no place for one of the tables.
    """
    text = document.read_text(encoding="utf-8")
    for name, table in tables.items():
        start = f"<!-- table: {name} -->"
        place = re.compile(f"{re.escape(start)}.*?<!-- end -->", re.DOTALL)
        if not place.search(text):
            raise InvalidSettingError(
                f"{document} has no place for the table {name!r}; expected a line {start!r} and "
                "after it a line '<!-- end -->'"
            )
        filled = f"{start}\n{table}\n<!-- end -->"
        text = place.sub(lambda _, filled=filled: filled, text)  # type: ignore[misc]
    document.write_text(text, encoding="utf-8")
