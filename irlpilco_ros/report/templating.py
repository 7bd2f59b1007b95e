"""Pages are Jinja2 templates; HTML is escaped, and no name is left undefined."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape


def render(
    package: str, template: str, filters: Mapping[str, Callable[..., object]], **values: Any
) -> str:
    """Return a template filled in.

    Args:
        package: Whose folder `templates` it is in, such as "irlpilco_ros.report".
        template: Name of the file.
        filters: What the template may apply to values, besides Jinja2's own filters.
        values: By the names that the template gives them.

    Raises:
        jinja2.UndefinedError: the template uses a name that nobody gave it.
    """
    environment = Environment(
        loader=PackageLoader(package),
        autoescape=select_autoescape(["html"]),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters.update(filters)
    return environment.get_template(template).render(values)
