"""Figures as lean SVG: matplotlib's own, without what a reader of the page would only download."""

from __future__ import annotations

import io
import re

from matplotlib.figure import Figure

from irlpilco_ros.report import style

FONTS = "Helvetica Neue,Helvetica,Arial,Liberation Sans,DejaVu Sans,sans-serif"
"""Fonts of the text, the page's own. All are narrower than the one that the layout allows for."""


def to_svg(figure: Figure) -> str:
    """Return a figure as an SVG element without XML prologue, a third of matplotlib's in size."""
    buffer = io.StringIO()
    with style.look():
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>|<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r' transform="rotate\(-0 [^"]*"', "", text)
    text = text.replace("'DejaVu Sans', sans-serif", FONTS)
    return _styles_to_classes(_shorten(_drop_ids(text)))


def _shorten(text: str) -> str:
    """Write coordinates to 0.01 point and drop white space between tags and in paths."""
    number = re.compile(r"(?<![\w.#])(\d+\.\d\d)\d+")
    text = re.sub(r"<[^>]*>", lambda tag: number.sub(r"\1", tag.group()), text)
    text = re.sub(r">\s+<", "><", text)
    path = re.compile(r'(?<= d=")[^"]*')
    return path.sub(lambda match: re.sub(r"\s*([A-Za-z])\s*", r"\1", match.group()), text)


def _drop_ids(text: str) -> str:
    """Keep only the ids that are referred to."""
    used = set(re.findall(r"#([\w.-]+)", text))
    keep = re.compile(r' id="([^"]*)"')
    return keep.sub(lambda match: match.group() if match.group(1) in used else "", text)


def _styles_to_classes(text: str) -> str:
    """Name every distinct style once, in a style sheet, instead of writing it out every time."""
    styles = list(dict.fromkeys(re.findall(r' style="([^"]*)"', text)))
    names = {declarations: f"s{number}" for number, declarations in enumerate(styles)}
    text = re.sub(r' style="([^"]*)"', lambda match: f' class="{names[match.group(1)]}"', text)
    sheet = "".join(f".{name}{{{declarations}}}" for declarations, name in names.items())
    return text.replace("</style>", f"{sheet}</style>", 1)
