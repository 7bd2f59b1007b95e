"""Joints over time, of several recordings on top of each other."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from irlpilco_ros.experience.episodes import Episode
from irlpilco_ros.report import style

COLUMNS = 4
ROW_HEIGHT = 1.7  # [in]
_COLOURS = (style.INK, style.ORANGE, style.BLUE, "#009E73", "#CC79A7", "#E69F00", style.FAINT)
_DASHES = ("-", (0, (5, 2)), (0, (1, 1.2)), (0, (6, 2, 1, 2)))


def bag_figure(episodes: Sequence[Episode], joints: Sequence[str]) -> Figure:
    """Draw the positions of joints over the time since each recording began.

    Args:
        episodes: The recordings; what one does not tell of is left out.
        joints: A panel for each.
    """
    with style.look():
        columns = min(COLUMNS, len(joints))
        rows = -(-len(joints) // columns)
        figure = Figure(figsize=(style.PAGE_WIDTH, 0.6 + ROW_HEIGHT * rows), layout="constrained")
        panels = figure.subplots(rows, columns, sharex=True, squeeze=False).ravel()
        for axes, joint in zip(panels, joints, strict=False):
            axes.set_title(joint)
            for number, episode in enumerate(episodes):
                if joint in episode.joints:
                    axes.plot(
                        episode.times,
                        episode.positions[:, episode.joints.index(joint)],
                        color=_COLOURS[number % len(_COLOURS)],
                        linestyle=_DASHES[number % len(_DASHES)],
                        linewidth=1.3,
                        label=episode.name,
                    )
        for axes in panels[len(joints) :]:
            axes.set_visible(False)
        for axes in panels[: len(joints)][-columns:]:
            axes.tick_params(labelbottom=True)
        figure.supxlabel("time since the recording began [s]")
        figure.supylabel("joint position [rad]; [m] if it slides")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
        return figure
