"""Which inputs of the dynamics model matter: its length-scales as one picture."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from irlpilco_ros.report import style
from irlpilco_ros.report.run_summary import ModelSummary


def relevance_figure(model: ModelSummary) -> Figure:
    """Draw the spread of the training data in length-scales, outputs by inputs.

    A cell of 1 says that the data span one length-scale of that input: the output bends with
    it. Below 0.03 the output is all but constant or linear in it.
    """
    with style.look():
        height = max(0.172 * len(model.output_names) + 2.2, 3.4)
        figure = Figure(figsize=(style.PAGE_WIDTH, height), layout="constrained")
        axes = figure.subplots()
        norm = LogNorm(vmin=0.03, vmax=3.0, clip=True)
        colours: dict[str, Any] = {"cmap": style.SEQUENTIAL, "norm": norm}
        image = axes.pcolormesh(model.relevance, edgecolors="white", linewidth=0.4, **colours)
        axes.invert_yaxis()
        _names(axes, model)
        bar = figure.colorbar(image, ax=axes, shrink=0.6, aspect=32, pad=0.01, extend="both")
        bar.set_label("spread of the data in length-scales")
        bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        return figure


def _names(axes: Axes, model: ModelSummary) -> None:
    """Write the joints at the edges, and what is measured in blocks further out."""
    axes.grid(False)
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0, pad=2)
    joints, blocks = _split(model.input_names)
    places = [i + 0.5 for i in range(len(joints))]
    axes.set_xticks(places, joints, rotation=90, fontsize=6.6)
    transform = axes.get_xaxis_transform()
    for first, last, name in blocks:
        axes.text(0.5 * (first + last), 1.02, name, ha="center", va="bottom", transform=transform)
        if first:
            axes.axvline(first, color=style.INK, linewidth=0.8)
    axes.set_xlabel("input of the model")
    joints, blocks = _split(model.output_names)
    axes.set_yticks([i + 0.5 for i in range(len(joints))], joints, fontsize=6.6)
    for first, _, _ in blocks[1:]:
        axes.axhline(first, color=style.INK, linewidth=0.8)
    axes.set_ylabel("increment over one step of: " + ", then ".join(b[2] for b in blocks))


def _split(names: tuple[str, ...]) -> tuple[list[str], list[tuple[int, int, str]]]:
    """Split "left_s0 velocity" into joint and quantity; return also (first, last, quantity)."""
    joints = [style.pretty(name.rpartition(" ")[0]) for name in names]
    blocks: list[tuple[int, int, str]] = []
    for index, name in enumerate(names):
        quantity = name.rpartition(" ")[2]
        if blocks and blocks[-1][2] == quantity:
            blocks[-1] = (blocks[-1][0], index + 1, quantity)
        else:
            blocks.append((index, index + 1, quantity))
    return joints, blocks
