"""The report as one HTML page: text, numbers, and figures as data URIs; nothing is loaded."""

from __future__ import annotations

import base64
import math
from dataclasses import dataclass, field
from html import escape

from irlpilco_ros.report.page_style import CSS, SCRIPT
from irlpilco_ros.report.run_summary import DebrisCount, IterationSummary, RunSummary

VIEWS = {"position": "positions", "difference": "difference from the demonstration"}


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


def render_page(run: RunSummary, artwork: Artwork) -> str:
    """Return the whole page."""
    sections = [
        _header(run, artwork),
        *(f'<p class="note">{escape(note)}</p>' for note in artwork.notes),
        _pictures(artwork),
        _errors(run, artwork),
        _debris(artwork),
        _joints(run, artwork),
        _weights(artwork),
        _relevance(artwork),
        _time(artwork),
        _settings(run),
    ]
    title = escape(f"{run.name}: learned from one demonstration")
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{title}</title>\n<style>{CSS}</style>\n</head>\n<body>\n"
        + "\n".join(section for section in sections if section)
        + f"\n<script>{SCRIPT}</script>\n</body>\n</html>\n"
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


def _header(run: RunSummary, artwork: Artwork) -> str:
    last, steps = run.last, len(run.times) - 1
    trials = f"{len(run.iterations)} trial" + ("s" if len(run.iterations) > 1 else "")
    lede = (
        f"The robot was shown the task once. After {trials}, {duration(last.robot_time)} of robot "
        f"time and {duration(run.computing_time)} of computing, its joints follow the "
        f"demonstration to within {last.rmse:.4f} rad (root mean square)."
    )
    if math.isfinite(run.replay_rmse):
        lede += (
            " Sending the demonstrated velocities without any learning (open-loop replay) "
            f"is {run.replay_rmse:.4f} rad off."
        )
    facts = (
        f"{len(run.joints)} joints · {run.times[-1]:g} s per trial · {steps} decisions, one every "
        f"{run.times[1] - run.times[0]:g} s"
    )
    return (
        f"<header>\n<h1>Run “{escape(run.name)}”: learned from one demonstration</h1>\n"
        f'<p class="faint">{escape(facts)}</p>\n<p class="lede">{escape(lede)}</p>\n'
        f"{_tiles(run, artwork.debris_count)}\n</header>"
    )


def _tiles(run: RunSummary, debris: DebrisCount | None) -> str:
    last = run.last
    tiles = [
        ("main", f"joint error, trial {last.index}", f"{last.rmse:.4f} <small>rad</small>"),
        ("", "robot time", duration(last.robot_time)),
        ("", "computing time", duration(run.computing_time)),
    ]
    if math.isfinite(run.replay_rmse):
        replay = f"{run.replay_rmse:.4f} <small>rad</small>"
        tiles.insert(1, ("", "open-loop replay", replay))
    if debris is not None:
        learned = list(debris.counts.values())[-1].mean()
        mean = f"{learned:.1f} <small>of {debris.pieces} pieces</small>"
        tiles.append(("", f"debris in the pan, mean of {len(debris.seeds)} sweeps", mean))
    cells = "\n".join(
        f'<div class="{kind}"><dt>{name}</dt><dd>{value}</dd></div>' for kind, name, value in tiles
    )
    return f'<dl class="tiles">\n{cells}\n</dl>'


def _pictures(artwork: Artwork) -> str:
    if artwork.animation is None and artwork.filmstrip is None:
        return ""
    parts = ["<h2>The sweep, as shown and as learned</h2>"]
    if artwork.animation is not None:
        alt = "Animation: the demonstration on the left and the latest trial on the right."
        caption = (
            "<b>Left: demonstration. Right: the latest trial.</b> The arms are guided along the "
            "positions in the bags; the debris is simulated. In real time."
        )
        parts.append(_figure(_webp(artwork.animation), alt, caption))
    if artwork.filmstrip is not None:
        alt = "Filmstrip: demonstration above, latest trial below, at the same times."
        caption = "Demonstration (above) and latest trial (below) at the same times."
        parts.append(_figure(_webp(artwork.filmstrip), alt, caption))
    return "\n".join(parts)


def _errors(run: RunSummary, artwork: Artwork) -> str:
    values = ", ".join(f"{i.rmse:.4f}" for i in run.iterations)
    alt = f"Joint error over the iterations [rad]: {values}."
    if math.isfinite(run.replay_rmse):
        alt += f" Open-loop replay: {run.replay_rmse:.4f}."
    caption = (
        "<b>Error of every trial against the demonstration</b>, root mean square over all joints "
        "and times. Diamonds: what the model expected of the trial, its uncertainty included. "
        "Replay sends the demonstrated velocities without looking at the robot."
    )
    return (
        "<h2>Error over iterations</h2>\n"
        + _figure(_svg(artwork.error), alt, caption)
        + _metrics_table(run)
    )


def _metrics_table(run: RunSummary) -> str:
    headings = (
        "iteration",
        "joint RMSE [rad]",
        "error (6.1)",
        "margin",
        "cost",
        "robot time so far [s]",
        "model [s]",
        "policy [s]",
    )
    rows = [_metrics_row(i, i is run.last) for i in run.iterations]
    if math.isfinite(run.replay_rmse):
        cells = ["open-loop replay", f"{run.replay_rmse:.4f}", f"{run.replay_rmse**2:.2e}"]
        rows.append(_row(cells + ["-"] * 5, "replay"))
    head = "".join(f'<th scope="col">{escape(h)}</th>' for h in headings)
    body = "\n".join(rows)
    return f'\n<div class="scroll"><table>\n<tr>{head}</tr>\n{body}\n</table></div>{_remarks(run)}'


def _remarks(run: RunSummary) -> str:
    """Return what the computing of the iterations had to say."""
    remarks = [f"Iteration {i.index}: {note}" for i in run.iterations for note in i.notes]
    return "".join(f'\n<p class="faint">{escape(remark)}</p>' for remark in remarks)


def _metrics_row(iteration: IterationSummary, is_last: bool) -> str:
    name = "0, initial trial" if iteration.index == 0 else str(iteration.index)
    cells = [
        name,
        f"{iteration.rmse:.4f}",
        _number(iteration.mse, ".2e"),
        _number(iteration.margin, ".2e"),
        _number(iteration.cost, ".4g"),
        f"{iteration.robot_time:.0f}",
        _number(iteration.model_time if iteration.index else math.nan, ".1f"),
        _number(iteration.policy_time if iteration.index else math.nan, ".1f"),
    ]
    return _row(cells, "last" if is_last else "")


def _debris(artwork: Artwork) -> str:
    count = artwork.debris_count
    if artwork.debris is None or count is None:
        return ""
    means = ", ".join(f"{name} {values.mean():.1f}" for name, values in count.counts.items())
    alt = f"Pieces in the pan of {count.pieces}, mean over {len(count.seeds)} scatterings: {means}."
    caption = (
        f"<b>{count.pieces} pieces of debris, scattered anew {len(count.seeds)} times</b>, and "
        "swept in simulation along each recorded motion. A grey line joins the same scattering, "
        "a bar is the mean. Where a single piece rolls is chaotic: compare the means."
    )
    return "<h2>The task itself: debris in the pan</h2>\n" + _figure(
        _svg(artwork.debris), alt, caption
    )


def _joints(run: RunSummary, artwork: Artwork) -> str:
    iterations = {str(i.index): str(i.index) for i in run.iterations}
    controls = _choice("Iteration", "iteration", iterations, str(run.last.index)) + _choice(
        "Show", "view", VIEWS, "position"
    )
    figures = []
    for (index, view), svg in artwork.joints.items():
        iteration = next(i for i in run.iterations if i.index == index)
        alt = (
            f"All {len(run.joints)} joints in trial {index}, {VIEWS[view]}: demonstration, "
            f"prediction and robot; joint error {iteration.rmse:.4f} rad."
        )
        caption = (
            f"<b>Trial {index}</b>, {VIEWS[view]}, [rad] over time [s]. At the right of each "
            "name: root mean square of its error [rad]."
        )
        if iteration.prediction is not None:
            caption += (
                " The prediction was made before the trial, from all trials before it; "
                f"{100 * run.coverage(iteration):.0f} % of the trial are within its band."
            )
        attributes = f' class="joints" id="joints-{index}-{view}"'
        figures.append(_figure(_svg(svg), alt, caption, attributes))
    return (
        "<h2>Joint by joint</h2>\n"
        f'<div id="joint-controls" hidden>\n{controls}</div>\n' + "\n".join(figures)
    )


def _choice(legend: str, name: str, options: dict[str, str], chosen: str) -> str:
    buttons = "".join(
        f'<label><input type="radio" name="{name}" value="{value}"'
        f"{' checked' if value == chosen else ''}><span>{escape(label)}</span></label>"
        for value, label in options.items()
    )
    return f'<fieldset class="choice"><legend>{legend}</legend>{buttons}</fieldset>\n'


def _weights(artwork: Artwork) -> str:
    alt = "Cost weight of every joint in every iteration, and the margin over the iterations."
    caption = (
        "<b>Weights of the squared errors in the cost, and the margin.</b> By max-margin, the "
        "weights are those that keep all trials so far as far from the demonstration as "
        "possible: a large weight says that this joint still gives the robot away."
    )
    return "<h2>Cost weights and margin</h2>\n" + _figure(_svg(artwork.weights), alt, caption)


def _relevance(artwork: Artwork) -> str:
    if artwork.relevance is None:
        return ""
    alt = "Heat map: relevance of every input of the dynamics model for every output."
    caption = (
        "<b>Length-scales of the latest Gaussian-process model</b>, shown as spread of the "
        "training data divided by length-scale: dark means that the output bends with this "
        "input, white that it is constant (or, with a prior mean, linear) in it."
    )
    return "<h2>What matters to the model</h2>\n" + _figure(_svg(artwork.relevance), alt, caption)


def _time(artwork: Artwork) -> str:
    alt = "Computing time of every iteration, and robot time used so far."
    caption = "<b>Time</b> spent on computing, and on the robot (moving to the start not counted)."
    return "<h2>Time</h2>\n" + _figure(_svg(artwork.time), alt, caption)


def _settings(run: RunSummary) -> str:
    if not run.settings:
        return ""
    rows = "\n".join(
        f"<tr><td><code>{escape(key)}</code></td><td><code>{escape(value)}</code></td></tr>"
        for key, value in run.settings.items()
    )
    return (
        "<h2>Settings</h2>\n<details><summary>All settings of this run</summary>\n"
        f'<table class="settings">\n{rows}\n</table></details>'
    )


def _figure(source: str, alt: str, caption: str, attributes: str = "") -> str:
    return (
        f'<figure{attributes}><img src="{source}" alt="{escape(alt)}">\n'
        f"<figcaption>{caption}</figcaption></figure>"
    )


def _svg(text: str) -> str:
    return "data:image/svg+xml;base64," + base64.b64encode(text.encode()).decode()


def _webp(data: bytes) -> str:
    return "data:image/webp;base64," + base64.b64encode(data).decode()


def _row(cells: list[str], kind: str) -> str:
    return f'<tr class="{kind}">' + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"


def _number(value: float, form: str) -> str:
    return format(value, form) if math.isfinite(value) else "-"
