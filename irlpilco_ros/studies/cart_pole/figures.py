"""Figures of the cart-pole chapter: what answers figures 4.3-4.8 and half of 6.1 of the thesis."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from irlpilco_ros.report import style

Array = NDArray[np.float64]

_WIDTH, _HEIGHT = 480, 360  # [pixel] of the animation
_SCALE = 180.0  # [pixel/m]
_FRAMES_PER_STEP = 4


@dataclass(frozen=True)
class Shown:
    """One trial in a figure.

    Attributes:
        title: What it is.
        states: (H + 1, 4) [m, rad, m/s, rad/s].
        prediction: Means (H + 1, 4) and covariances (H + 1, 4, 4), or None.
    """

    title: str
    states: Array
    prediction: tuple[Array, Array] | None


def trials_figure(expert: Array, trials: Sequence[Shown], dt: float) -> Figure:
    """Draw x and theta over time: the expert, each trial, and its prediction with 2 sigma.

    Args:
        expert: States of the demonstration, shape (H + 1, 4).
        trials: One column each.
        dt: Control period [s].
    """
    times: Array = dt * np.arange(len(expert), dtype=float)
    with style.look():
        figure = Figure(figsize=(style.PAGE_WIDTH, 5.4), layout="constrained")
        axes = figure.subplots(2, len(trials), sharex=True, sharey="row", squeeze=False)
        for column, trial in enumerate(trials):
            axes[0, column].set_title(trial.title)
            axes[1, column].set_xlabel("time [s]")
            for row, state in enumerate((0, 1)):
                _draw(axes[row, column], times, expert, trial, state)
        axes[0, 0].set_ylabel("cart x [m]")
        axes[1, 0].set_ylabel("pole θ [rad]")
        for row, (low, high) in enumerate(((-1.5, 1.5), (-5.0, 5.0))):
            shown = [expert, *(trial.states for trial in trials)]
            reach = np.array([[values[:, row].min(), values[:, row].max()] for values in shown])
            # A prediction of a model that knows little covers everything; the axes do not follow.
            axes[row, 0].set_ylim(
                max(low, reach[:, 0].min()) - 0.3, min(high, reach[:, 1].max()) + 0.3
            )
        handles, labels = axes[0, -1].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure


def _draw(axes: Axes, times: Array, expert: Array, trial: Shown, state: int) -> None:
    if trial.prediction is not None:
        means, covariances = trial.prediction
        mean = means[:, state]
        reach = 2.0 * np.sqrt(np.maximum(covariances[:, state, state], 0.0))
        axes.fill_between(times, mean - reach, mean + reach, label="2 sigma", **style.BAND)
        axes.plot(times, mean, label="prediction", **style.PREDICTION)
    axes.plot(times, expert[:, state], label="expert", **style.DEMONSTRATION)
    axes.plot(times, trial.states[:, state], label="trial", **style.ROBOT)


def errors_figure(errors: Mapping[str, Sequence[Sequence[float]]]) -> Figure:
    """Draw the error (6.1) over iterations: each seed thin, the median thick.

    Args:
        errors: For each method, for each seed, the error of every trial from iteration 1 on.
    """
    looks = (("#0072B2", "-"), ("#D55E00", (0, (4, 2))))
    with style.look():
        figure = Figure(figsize=(0.62 * style.PAGE_WIDTH, 3.6), layout="constrained")
        axes = figure.subplots()
        for (method, seeds), (colour, line) in zip(errors.items(), looks, strict=False):
            for values in seeds:
                steps = range(1, len(values) + 1)
                axes.plot(steps, values, color=colour, linestyle=line, linewidth=0.6, alpha=0.4)
            length = min(len(values) for values in seeds)
            median = np.median([values[:length] for values in seeds], axis=0)
            axes.plot(
                range(1, length + 1),
                median,
                color=colour,
                linestyle=line,
                linewidth=2.2,
                label=method,
            )
        style.log_scale(axes)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlabel("iteration")
        axes.set_ylabel("error (6.1)")
        axes.set_title("Distance from the expert: median and every seed")
        axes.legend()
    return figure


def animation(trials: Sequence[tuple[str, Array]], dt: float, length: float) -> bytes:
    """Return trials side by side, in real time, as an animated GIF.

    Args:
        trials: Names, and states (H + 1, 4).
        dt: Control period [s].
        length: Of the pole [m].
    """
    steps = min(len(states) for _, states in trials)
    instants = np.linspace(0, steps - 1, _FRAMES_PER_STEP * (steps - 1) + 1)
    frames = []
    for instant in instants:
        frame = Image.new("RGB", (_WIDTH * len(trials), _HEIGHT), "white")
        draw = ImageDraw.Draw(frame)
        for place, (name, states) in enumerate(trials):
            x, theta = (np.interp(instant, np.arange(len(states)), states[:, i]) for i in (0, 1))
            _cart_pole(draw, _WIDTH * (place + 0.5), float(x), float(theta), length)
            draw.text((_WIDTH * place + 12, 10), f"{name}   {instant * dt:.1f} s", fill=style.INK)
        frames.append(frame)
    buffer = io.BytesIO()
    duration = round(1000.0 * dt / _FRAMES_PER_STEP)
    frames[0].save(
        buffer,
        format="GIF",
        save_all=True,
        append_images=frames[1:],
        duration=[duration] * (len(frames) - 1) + [1500],
        loop=0,
    )
    return buffer.getvalue()


def _cart_pole(
    draw: ImageDraw.ImageDraw, centre: float, x: float, theta: float, length: float
) -> None:
    ground = _HEIGHT * 0.55
    cart = centre + _SCALE * x
    tip = cart + _SCALE * length * np.sin(theta), ground + _SCALE * length * np.cos(theta)
    draw.line(
        (centre - 0.48 * _WIDTH, ground, centre + 0.48 * _WIDTH, ground), fill="#bbbbbb", width=2
    )
    goal = ground - _SCALE * length
    draw.ellipse((centre - 6, goal - 6, centre + 6, goal + 6), outline="#009E73", width=2)
    draw.rectangle((cart - 24, ground - 10, cart + 24, ground + 10), fill=style.BLUE)
    draw.line((cart, ground, *tip), fill=style.ORANGE, width=6)
