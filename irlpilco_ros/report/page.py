"""The report as one HTML page: text, numbers, and figures as data URIs; nothing is loaded.

The page is templates/page.html; what is worked out for it is worked out here.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime

from markupsafe import Markup

from irlpilco_ros import __version__
from irlpilco_ros.report.joint_figures import joint_groups
from irlpilco_ros.report.page_tables import (
    acceleration_table,
    error_table,
    learning_table,
    number,
    use_sentence,
    use_table,
)
from irlpilco_ros.report.run_summary import DebrisCount, RunSummary
from irlpilco_ros.report.templating import render

VIEWS = {"difference": "difference from the demonstration", "position": "positions"}
"""What is drawn of the joints; the first is shown first."""


@dataclass(frozen=True)
class Artwork:
    """Everything on the page that is not text.

    Attributes:
        error: SVG of the error over iterations.
        weights: SVG of weights and margin.
        time: SVG of the timing.
        joints: SVG of all joints by (iteration, view), view a key of `VIEWS`.
        relevance: SVG of the model's relevant inputs, or None before the first iteration.
        debris: SVG of the debris in the pan, or None.
        debris_count: its numbers, or None.
        filmstrip: WebP, or None.
        animation: animated WebP, or None.
        notes: one sentence for everything that could not be made, and what to do about it.
    """

    error: str
    weights: str
    time: str
    joints: dict[tuple[int, str], str]
    relevance: str | None = None
    debris: str | None = None
    debris_count: DebrisCount | None = None
    filmstrip: bytes | None = None
    animation: bytes | None = None
    notes: tuple[str, ...] = field(default=())


@dataclass(frozen=True)
class Made:
    """How a page came about.

    Attributes:
        when: Such as "2026-11-27 09:54 UTC".
        version: Of this package.
        command: What made it.
    """

    when: str
    version: str
    command: str

    @classmethod
    def now(cls, command: str) -> Made:
        """Return how a page comes about that this command makes now."""
        when = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
        return cls(when, __version__, command)


@dataclass(frozen=True)
class JointFigure:
    """All joints of one trial in one view, and what is said of them."""

    id: str
    index: int
    view: str
    svg: str
    alt: str
    coverage: int | None


def render_page(run: RunSummary, artwork: Artwork, made: Made) -> str:
    """Return the whole page."""
    count = len(run.iterations)
    debris = artwork.debris_count
    return render(
        "irlpilco_ros.report",
        "page.html",
        {"duration": duration, "svg": _svg, "webp": _webp},
        run=run,
        artwork=artwork,
        made=made,
        debris=debris,
        debris_alt="" if debris is None else _debris_alt(debris),
        unit=run.unit,
        has_replay=math.isfinite(run.replay_rmse),
        shown=_shown(run.demonstrations),
        arms=len(joint_groups(run.joints)),
        trials=f"{count} trial{'s' if count > 1 else ''}",
        errors_alt=_errors_alt(run),
        errors=error_table(run),
        accelerations=acceleration_table(run),
        learned=learning_table(run),
        uses=use_table(run),
        use_sentence=use_sentence(run),
        iterations={str(each.index): str(each.index) for each in run.iterations},
        views=VIEWS,
        joints=list(_joints(run, artwork)),
    )


def duration(seconds: float) -> str:
    """Return a time as one says it: "0.4 s", "48 s", "2 min 5 s", "1 h 12 min"."""
    if seconds < 1.0:
        return f"{seconds:.1g}\N{NO-BREAK SPACE}s"
    whole = round(seconds)
    if whole < 100:
        return f"{whole}\N{NO-BREAK SPACE}s"
    minutes, rest = divmod(whole, 60)
    if minutes < 60:
        return f"{minutes} min {rest} s".replace(" ", "\N{NO-BREAK SPACE}")
    return f"{minutes // 60} h {minutes % 60} min".replace(" ", "\N{NO-BREAK SPACE}")


def _shown(demonstrations: int) -> str:
    return "one demonstration" if demonstrations == 1 else f"{demonstrations} demonstrations"


def _errors_alt(run: RunSummary) -> str:
    path = ""
    if run.path_is_known:
        values = ", ".join(number(each.path.rmse, ".4f") for each in run.iterations)
        path = f"Error over the whole path [{run.unit}]: {values}. "
    values = ", ".join(f"{each.rmse:.4f}" for each in run.iterations)
    alt = f"{path}Error at the decisions [{run.unit}]: {values}."
    if math.isfinite(run.replay_rmse):
        alt += f" Open-loop replay: {run.replay_rmse:.4f}."
    return alt


def _debris_alt(debris: DebrisCount) -> str:
    means = ", ".join(f"{name} {values.mean():.1f}" for name, values in debris.counts.items())
    seeds = len(debris.seeds)
    return f"Pieces in the pan of {debris.pieces}, mean over {seeds} scatterings: {means}."


def _joints(run: RunSummary, artwork: Artwork) -> Iterator[JointFigure]:
    by_index = {each.index: each for each in run.iterations}
    for (index, view), svg in artwork.joints.items():
        iteration = by_index[index]
        alt = (
            f"All {len(run.joints)} joints in trial {index}, {VIEWS[view]}: demonstration, "
            f"prediction and robot; error {iteration.rmse:.4f} {run.unit}."
        )
        predicted = iteration.prediction is not None
        coverage = round(100 * run.coverage(iteration)) if predicted else None
        yield JointFigure(f"joints-{index}-{view}", index, VIEWS[view], svg, alt, coverage)


def _svg(text: str) -> Markup:
    return Markup("data:image/svg+xml;base64," + base64.b64encode(text.encode()).decode())


def _webp(data: bytes) -> Markup:
    return Markup("data:image/webp;base64," + base64.b64encode(data).decode())
