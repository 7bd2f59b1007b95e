"""The report of a run, from its directory to RUN/report/index.html."""

from __future__ import annotations

import logging
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from irlpilco_ros.experience.durable import write_atomically
from irlpilco_ros.experience.errors import FileError
from irlpilco_ros.experience.run_directory import RunDirectory
from irlpilco_ros.learning.errors import IrlPilcoError
from irlpilco_ros.report import style
from irlpilco_ros.report.debris_figure import debris_figure
from irlpilco_ros.report.joint_figures import difference_figure, position_figure
from irlpilco_ros.report.model_figure import relevance_figure
from irlpilco_ros.report.moving_pictures import animation, filmstrip, to_webp
from irlpilco_ros.report.page import Artwork, Made, render_page
from irlpilco_ros.report.progress_figures import error_figure, time_figure, weights_figure
from irlpilco_ros.report.read_run import read_run
from irlpilco_ros.report.resimulation import workers
from irlpilco_ros.report.run_summary import RunSummary
from irlpilco_ros.report.svg import to_svg
from irlpilco_ros.report.sweeps import SimulatedSweeps, SweepJobs

Progress = Callable[[str, float], None]

PNG_RESOLUTION = 160
"""Of the separate picture files [dots per inch]."""

_LOGGER = logging.getLogger(__name__)


def build_report(
    run_directory: Path | str, progress: Progress | None = None, command: str = ""
) -> Path:
    """Write RUN/report/: index.html, one file that needs nothing else, and every figure by itself.

    What cannot be made here (pictures without EGL or OSMesa, simulation without MuJoCo or of
    another robot) is left out, and the page says so.

    Args:
        run_directory: The run; it is only read, but for its report/.
        progress: Called as progress(stage, fraction) with a stage's name and 0..1 of the whole.
        command: What the page says that it was made by; empty for `irlpilco report RUN`.

    Returns:
        Path of index.html.

    Raises:
        RunDirectoryError: this is no run directory, or no trial of it was judged yet.
        BagError: a bag of it cannot be read.
        FileError: the report cannot be written, for example because the disk is full.
    """
    try:
        made = Made.now(command or shlex.join(["irlpilco", "report", str(run_directory)]))
        return _build(RunDirectory(run_directory), made, progress or _say_nothing)
    except OSError as error:
        if isinstance(error, IrlPilcoError):
            raise
        folder = RunDirectory(run_directory).report_directory
        where = f" ({error.filename})" if error.filename else ""
        raise FileError(
            f"cannot write the report {folder}: {error.strerror or error}{where}"
        ) from error


def _build(directory: RunDirectory, made: Made, tell: Progress) -> Path:
    tell("reading the run", 0.0)
    run = read_run(directory)
    folder = directory.report_directory
    folder.mkdir(exist_ok=True)
    # The sweeps are simulated by other processes while this one draws.
    with workers() as pool:
        jobs = SweepJobs.submit(run, pool)
        drawn = _draw_figures(run, folder, tell)
        sweeps = jobs.results(lambda part: tell("simulating sweeps", 0.5 + 0.4 * part))
    tell("writing the page", 0.92)
    for note in sweeps.notes:
        _LOGGER.warning(note)  # whoever waits for the report is told as well as who reads it
    artwork = Artwork(**drawn, **_draw_sweeps(sweeps, folder), notes=sweeps.notes)
    path = folder / "index.html"
    write_atomically(path, render_page(run, artwork, made).encode())
    tell("done", 1.0)
    return path


def _say_nothing(stage: str, fraction: float) -> None:
    pass


def _draw_figures(run: RunSummary, folder: Path, tell: Progress) -> dict[str, Any]:
    """Draw everything that needs no simulation; return it by the fields of `Artwork`."""
    tell("drawing figures", 0.02)
    drawn: dict[str, Any] = {
        "error": _save(error_figure(run), folder, "error"),
        "weights": _save(weights_figure(run), folder, "weights"),
        "time": _save(time_figure(run), folder, "time"),
        "joints": {},
    }
    if run.model is not None:
        drawn["relevance"] = _save(relevance_figure(run.model), folder, "relevance")
    for number, iteration in enumerate(run.iterations):
        tell("drawing joints", 0.1 + 0.4 * number / len(run.iterations))
        for view, draw in (("position", position_figure), ("difference", difference_figure)):
            name = f"joints_{iteration.index:03d}_{view}"
            png = iteration is run.best
            drawn["joints"][iteration.index, view] = _save(draw(run, iteration), folder, name, png)
    return drawn


def _draw_sweeps(sweeps: SimulatedSweeps, folder: Path) -> dict[str, Any]:
    """Draw what came out of the simulation; return it by the fields of `Artwork`."""
    drawn: dict[str, Any] = {}
    if sweeps.debris is not None:
        drawn["debris_count"] = sweeps.debris
        drawn["debris"] = _save(debris_figure(sweeps.debris), folder, "debris")
    if len(sweeps.films) == 2:
        first, second = sweeps.films.items()
        strip = filmstrip(first, second)
        strip.save(folder / "filmstrip.png")
        drawn["filmstrip"] = to_webp(strip)
        drawn["animation"] = animation(first, second)
        (folder / "sweep.webp").write_bytes(drawn["animation"])
    return drawn


def _save(figure: Figure, folder: Path, name: str, png: bool = True) -> str:
    """Write NAME.svg, and NAME.png if wanted, and return the SVG element."""
    svg = to_svg(figure)
    (folder / f"{name}.svg").write_text(f'<?xml version="1.0" encoding="utf-8"?>\n{svg}', "utf-8")
    if png:
        with style.look():
            figure.savefig(folder / f"{name}.png", dpi=PNG_RESOLUTION)
    return svg
