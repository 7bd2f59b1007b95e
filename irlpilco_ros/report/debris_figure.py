"""Debris in the pan: does the learned sweep do the task?"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from irlpilco_ros.report import style
from irlpilco_ros.report.run_summary import DebrisCount


def debris_figure(count: DebrisCount) -> Figure:
    """Draw the pieces in the pan for every scattering, and the mean, for each way of sweeping."""
    series: dict[str, tuple[Any, dict[str, Any]]] = {
        "demonstration": (count.demonstration, {"color": style.INK, "marker": "s"}),
        "open-loop\nreplay": (count.replay, {"color": style.FAINT, "marker": "D"}),
        "learned\npolicy": (count.learned, {"color": style.ORANGE, "marker": "o"}),
    }
    with style.look():
        figure = Figure(figsize=(style.PAGE_WIDTH * 0.62, 3.3), layout="constrained")
        axes = figure.subplots()
        offsets = np.linspace(-0.2, 0.2, len(count.seeds))
        table = np.stack([values for values, _ in series.values()])
        for seed, offset in enumerate(offsets):
            axes.plot(np.arange(3) + offset, table[:, seed], color="#d0d0d0", linewidth=0.9)
        for place, (values, look) in enumerate(series.values()):
            axes.plot(place + offsets, values, linestyle="", markersize=5.5, zorder=3, **look)
            mean = float(values.mean())
            axes.plot([place - 0.3, place + 0.3], [mean, mean], color=look["color"], linewidth=2.2)
            box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
            axes.text(place + 0.33, mean, f"mean {mean:.1f}", va="center", bbox=box)
        axes.set_xticks(range(3), list(series), fontsize=9.0)
        axes.set_xlim(-0.5, 2.75)
        axes.set_ylim(-0.4, count.pieces + 0.4)
        axes.grid(False, axis="x")
        axes.set_ylabel(f"pieces in the pan, of {count.pieces}")
        return figure
