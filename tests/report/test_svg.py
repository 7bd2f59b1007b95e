from __future__ import annotations

import io
import re
from xml.etree import ElementTree

import numpy as np
from matplotlib.figure import Figure
from report_runs import summary

from irlpilco_ros.report import style
from irlpilco_ros.report.joint_figures import position_figure
from irlpilco_ros.report.svg import to_svg

NAMESPACE = "{http://www.w3.org/2000/svg}"


def drawn() -> Figure:
    with style.look():
        figure = Figure()
        axes = figure.subplots()
        axes.plot(np.linspace(0.0, 1.0, 40), np.linspace(0.0, 0.001234567, 40), marker="o")
        axes.set_title("error 0.0012345 rad < 1 & more")
        axes.set_yticks([0.0001, 0.0005], ["0.00012", "0.00055"])
        return figure


def texts(svg: str) -> list[str]:
    return [element.text or "" for element in ElementTree.fromstring(svg).iter(f"{NAMESPACE}text")]


def test_numbers_that_are_read_keep_their_digits() -> None:
    written = texts(to_svg(drawn()))
    assert "error 0.0012345 rad < 1 & more" in written
    assert {"0.00012", "0.00055"} <= set(written)


def test_everything_referred_to_is_there() -> None:
    svg = to_svg(drawn())
    references = set(re.findall(r'(?:href="|url\()#([\w.-]+)', svg))
    assert references
    assert references == set(re.findall(r' id="([^"]+)"', svg))


def test_styles_become_classes_that_are_defined() -> None:
    svg = to_svg(drawn())
    assert ' style="' not in svg
    used = set(re.findall(r' class="(\w+)"', svg))
    assert used == set(re.findall(r"\.(s\d+)\{", svg))
    sheet = next(ElementTree.fromstring(svg).iter(f"{NAMESPACE}style")).text or ""
    assert re.search(r"stroke: #[0-9a-f]{6}", sheet)


def test_it_is_at_most_half_of_what_matplotlib_writes() -> None:
    run = summary(tuple(f"j{number}" for number in range(7)))
    buffer = io.StringIO()
    with style.look():
        position_figure(run, run.last).savefig(buffer, format="svg")
    assert len(to_svg(position_figure(run, run.last))) < 0.5 * len(buffer.getvalue())


def test_same_figure_gives_the_same_bytes() -> None:
    assert to_svg(drawn()) == to_svg(drawn())
