"""The report as one HTML page: text, numbers, and figures as data URIs; nothing is loaded.

The page is templates/page.html; what is worked out for it is worked out here.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterator
from dataclasses import dataclass, field

from markupsafe import Markup

from irlpilco_ros.experience.path_quality import PathQuality
from irlpilco_ros.report.joint_figures import joint_groups
from irlpilco_ros.report.run_summary import DebrisCount, IterationSummary, RunSummary
from irlpilco_ros.report.templating import render

VIEWS = {"position": "positions", "difference": "difference from the demonstration"}

HEADINGS = (
    "iteration",
    "path, RMS",
    "path, largest",
    "acceleration, 99 % [rad/s²]",
    "acceleration, largest [rad/s²]",
    "at the decisions, RMS",
    "error (6.1)",
    "margin",
    "cost",
    "robot time so far [s]",
    "model [s]",
    "policy [s]",
)


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
class TableRow:
    """A row of the table of errors; `kind` is its class in the style sheet."""

    kind: str
    cells: tuple[str, ...]


@dataclass(frozen=True)
class JointFigure:
    """All joints of one trial in one view, and what is said of them."""

    id: str
    index: int
    view: str
    svg: str
    alt: str
    coverage: int | None


def render_page(run: RunSummary, artwork: Artwork) -> str:
    """Return the whole page."""
    count = len(run.iterations)
    debris = artwork.debris_count
    return render(
        "irlpilco_ros.report",
        "page.html",
        {"duration": duration, "svg": _svg, "webp": _webp},
        run=run,
        artwork=artwork,
        debris=debris,
        debris_alt="" if debris is None else _debris_alt(debris),
        unit=run.unit,
        has_replay=math.isfinite(run.replay_rmse),
        shown=_shown(run.demonstrations),
        arms=len(joint_groups(run.joints)),
        trials=f"{count} trial{'s' if count > 1 else ''}",
        errors_alt=_errors_alt(run),
        headings=HEADINGS,
        rows=list(_rows(run)),
        iterations={str(each.index): str(each.index) for each in run.iterations},
        views=VIEWS,
        joints=list(_joints(run, artwork)),
    )


def duration(seconds: float) -> str:
    """Return a time as one says it: "48 s", "2 min 5 s", "1 h 12 min"."""
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
        values = ", ".join(_number(each.path.rmse, ".4f") for each in run.iterations)
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


def _rows(run: RunSummary) -> Iterator[TableRow]:
    for each in run.iterations:
        yield TableRow("last" if each is run.last else "", _cells(each, each is run.best))
    if math.isfinite(run.replay_rmse):
        errors = (f"{run.replay_rmse:.4f}", f"{run.replay_rmse**2:.2e}")
        yield _baseline("open-loop replay", run.replay_path, *errors)
    if math.isfinite(run.demonstration_path.acceleration_max):
        yield _baseline("demonstration", run.demonstration_path)


def _baseline(name: str, path: PathQuality, *errors: str) -> TableRow:
    cells = (name, *_path_cells(path), *errors)
    return TableRow("replay", (*cells, *["-"] * (len(HEADINGS) - len(cells))))


def _path_cells(path: PathQuality) -> tuple[str, ...]:
    return (
        _number(path.rmse, ".4f"),
        _number(path.largest, ".4f"),
        _number(path.acceleration_p99, ".2f"),
        _number(path.acceleration_max, ".1f"),
    )


def _cells(iteration: IterationSummary, best: bool) -> tuple[str, ...]:
    learned = iteration.index > 0
    name = str(iteration.index) if learned else "0, initial trial"
    return (
        f"{name}, best" if best else name,
        *_path_cells(iteration.path),
        f"{iteration.rmse:.4f}",
        _number(iteration.mse, ".2e"),
        _number(iteration.margin, ".2e"),
        _number(iteration.cost, ".4g"),
        f"{round(iteration.robot_time, 1):g}",
        _number(iteration.model_time if learned else math.nan, ".1f"),
        _number(iteration.policy_time if learned else math.nan, ".1f"),
    )


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


def _number(value: float, form: str) -> str:
    return format(value, form) if math.isfinite(value) else "-"
