"""The whole report, with processes that simulate and draw, of a run of one second."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from report_runs import demonstrated, write_run

from irlpilco_ros.cli import main
from irlpilco_ros.experience.errors import FileError
from irlpilco_ros.report import build_report, sweeps
from irlpilco_ros.report.resimulation import PIECES, can_resimulate, count_debris
from irlpilco_ros.resources import config_file, recording
from sim_bridge.guided_motion import GuidedMotion
from sim_bridge.joints import ARM_JOINTS
from sim_bridge.motion_files import load_motion
from sim_bridge.rendering import can_render

needs_opengl = pytest.mark.skipif(not can_render(), reason="needs libegl1 or libosmesa6")


@pytest.fixture(autouse=True)
def one_scattering(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweeps, "DEBRIS_SEEDS", (3,))


def short_run(path: Path, iterations: int) -> Path:
    """A run over the first second of the sweep."""
    return write_run(path, ARM_JOINTS, load_motion().waypoints[:3], iterations).path


@needs_opengl
def test_report_is_one_page_with_everything(tmp_path: Path) -> None:
    run = short_run(tmp_path / "demo", iterations=1)
    told: list[tuple[str, float]] = []
    page = build_report(run, lambda stage, fraction: told.append((stage, fraction)))
    assert page == run / "report" / "index.html"
    html = page.read_text(encoding="utf-8")
    assert html.count("data:image/webp") == 2
    assert not re.search(r'(src|href)="(?!data:|#)', html)
    assert 'class="note"' not in html
    assert f"<code>irlpilco report {run}</code>" in html
    assert "Fastest for its limit" not in html, "its configuration tells no limits"
    assert page.stat().st_size < 6e6
    fractions = [fraction for _, fraction in told]
    assert fractions == sorted(fractions)
    assert (fractions[0], fractions[-1]) == (0.0, 1.0)
    names = {file.name for file in page.parent.iterdir()}
    for figure in ("error", "weights", "time", "relevance", "debris", "joints_000_position"):
        assert {f"{figure}.svg", f"{figure}.png"} <= names
    assert getattr(Image.open(page.parent / "sweep.webp"), "n_frames", 1) == 7
    strip = np.asarray(Image.open(page.parent / "filmstrip.png"), dtype=float)
    assert strip.std() > 20.0


def test_report_without_opengl_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MUJOCO_GL", "disable")
    html = build_report(short_run(tmp_path / "demo", iterations=0)).read_text(encoding="utf-8")
    assert "data:image/webp" not in html
    assert "libegl1" in html
    assert "debris in the pan" in html


def test_report_of_another_robot(tmp_path: Path) -> None:
    run = write_run(tmp_path / "other", ("shoulder", "elbow"), demonstrated(2, 4))
    html = build_report(run.path).read_text(encoding="utf-8")
    assert sweeps.NOT_THIS_ROBOT in html
    assert "jitter 1e-6 was added" in html


def test_demonstrated_sweep_fills_the_pan() -> None:
    assert count_debris(load_motion(), seed=0) >= 0.8 * PIECES


def test_arms_that_stand_still_sweep_nothing() -> None:
    start = np.repeat(load_motion().waypoints[:1], 3, axis=0)
    assert count_debris(GuidedMotion(ARM_JOINTS, 0.5, start), seed=0) == 0


def test_only_joints_of_the_simulated_robot_can_be_simulated() -> None:
    assert can_resimulate(ARM_JOINTS[:7])
    assert not can_resimulate((*ARM_JOINTS, "lift"))


def test_report_of_a_cart_pole_whose_pole_nobody_commands(tmp_path: Path) -> None:
    settings = tmp_path / "quick.yaml"
    settings.write_text(
        "/**: {ros__parameters: {prior_mean: zero, policy: rbf, initial_policy: random_controls, "
        "optimiser: bfgs, starts: [last], evaluations: 1, screening_evaluations: 0}}"
    )
    for number in ("000", "001"):
        shutil.copytree(recording("cart_pole/expert"), tmp_path / "trials" / number)
    run = tmp_path / "run"
    arguments = [
        *("--demonstration", str(recording("cart_pole/expert"))),
        *("--trials", str(tmp_path / "trials")),
        *("--robot", str(config_file("cart_pole.yaml"))),
        *("--settings", str(settings)),
        *("--run-directory", str(run)),
    ]
    assert main(["train", *arguments]) == 0
    assert main(["report", str(run)]) == 0
    html = (run / "report" / "index.html").read_text(encoding="utf-8")
    assert "rad and m" in html  # the cart slides, the pole turns
    for name in ("cart", "sin pole", "cos pole"):
        assert f">{name}</text>" in (run / "report" / "weights.svg").read_text(encoding="utf-8")
    relevance = (run / "report" / "relevance.svg").read_text(encoding="utf-8")
    assert relevance.count(">pole</text>") == 5  # velocity, sine, cosine; two outputs
    assert "Trial 1</b>" in html
    assert "Length-scales" in html


def test_report_of_joints_with_names_of_any_kind(tmp_path: Path) -> None:
    names = (r"$\frac{$", "<i>&")
    run = write_run(tmp_path / "odd", names, demonstrated(2, 4), 1)
    html = build_report(run.path).read_text(encoding="utf-8")
    assert "<i>&" not in html


def test_a_report_that_cannot_be_written_is_a_sentence_with_its_path(tmp_path: Path) -> None:
    run = write_run(tmp_path / "other", ("shoulder", "elbow"), demonstrated(2, 4)).path
    (run / "report").mkdir()
    (run / "report" / "error.svg").symlink_to("/dev/full")
    with pytest.raises(FileError, match=r"cannot write .*/report: No space left"):
        build_report(run)
    shutil.rmtree(run / "report")
    (run / "report").touch()
    with pytest.raises(FileError, match=r"cannot write .*/report: File exists"):
        build_report(run)
