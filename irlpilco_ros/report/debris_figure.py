"""Debris in the pan: does the learned sweep do the task?"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from irlpilco_ros.report import style
from irlpilco_ros.report.run_summary import DebrisCount

DEMONSTRATION = "demonstration"
REPLAY = "open-loop replay"
LEARNED = "learned policy"

_LOOKS: dict[str, dict[str, Any]] = {
    DEMONSTRATION: {"color": style.INK, "marker": "s"},
    REPLAY: {"color": style.FAINT, "marker": "D"},
    LEARNED: {"color": style.ORANGE, "marker": "o"},
}


def debris_figure(count: DebrisCount) -> Figure:
    """Draw the pieces in the pan for every scattering, and the mean, for each way of sweeping."""
    with style.look():
        figure = Figure(figsize=(style.PAGE_WIDTH * 0.66, 3.3), layout="constrained")
        axes = figure.subplots()
        offsets = np.linspace(-0.22, 0.22, len(count.seeds))
        table = np.stack(list(count.counts.values()))
        places = np.arange(len(table))
        for seed, offset in enumerate(offsets):
            axes.plot(places + offset, table[:, seed], color="#d8d8d8", linewidth=0.8)
        for place, (name, values) in enumerate(count.counts.items()):
            look = _LOOKS[name]
            axes.plot(place + offsets, values, linestyle="", markersize=5.0, zorder=3, **look)
            mean = float(values.mean())
            axes.plot([place - 0.3, place + 0.3], [mean, mean], color=look["color"], linewidth=2.2)
            box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
            axes.text(place + 0.33, mean, f"mean {mean:.1f}", va="center", bbox=box, zorder=4)
        axes.set_xticks(places, list(count.counts), fontsize=9.0)
        axes.set_xlim(-0.5, len(table) - 0.25)
        axes.set_ylim(-0.03 * count.pieces, 1.03 * count.pieces)
        axes.yaxis.set_major_locator(MaxNLocator(5, integer=True))
        axes.grid(False, axis="x")
        axes.set_ylabel(f"pieces in the pan, of {count.pieces}")
        return figure
