"""The look of the figures: one meaning, one colour and one line style, also in greyscale.

Colours are from Okabe and Ito's palette for the colour-blind; every series differs from the
others in line style or marker as well.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, NullFormatter

INK = "#222222"
FAINT = "#767676"
BLUE = "#0072B2"
ORANGE = "#D55E00"

DEMONSTRATION: dict[str, Any] = {"color": INK, "linestyle": "-", "linewidth": 2.0}
PREDICTION: dict[str, Any] = {"color": BLUE, "linestyle": (0, (4, 2)), "linewidth": 1.4}
BAND: dict[str, Any] = {"color": BLUE, "alpha": 0.22, "linewidth": 0.0}
ROBOT: dict[str, Any] = {
    "color": ORANGE,
    "linestyle": "-",
    "linewidth": 1.1,
    "marker": "o",
    "markersize": 3.2,
}
REPLAY: dict[str, Any] = {"color": FAINT, "linestyle": (0, (6, 2, 1, 2)), "linewidth": 1.5}

# Light at "does not matter", dark at "matters": one hue, so that greyscale keeps the order.
SEQUENTIAL = "Blues"

PAGE_WIDTH = 10.6
"""Width of a figure that fills the page [in]."""

_RC: Any = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.titlepad": 5.0,
    "axes.labelsize": 9.0,
    "axes.labelcolor": INK,
    "axes.edgecolor": FAINT,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "xtick.color": FAINT,
    "ytick.color": FAINT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "legend.frameon": False,
    "legend.fontsize": 9.0,
    "hatch.linewidth": 0.8,
    "svg.fonttype": "none",
    "svg.hashsalt": "irlpilco",
    "text.color": INK,
    "text.parse_math": False,  # a joint may be called anything
}


def look() -> AbstractContextManager[None]:
    """Return the context in which figures are drawn and saved."""
    return matplotlib.rc_context(_RC)


def pretty(joint: str) -> str:
    """Return a joint's name as one would write it: "left_s0" becomes "left s0"."""
    return joint.replace("_", " ")


def log_scale(axes: Axes) -> None:
    """Draw y by its logarithm, told in plain numbers: powers would be formulas, which are off."""
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())


def blank(axes: Axes) -> None:
    """Leave nothing of an axes but its place."""
    axes.set_axis_off()
