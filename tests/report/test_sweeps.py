from __future__ import annotations

import dataclasses
from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any

import numpy as np
import pytest
from report_runs import summary

from irlpilco_ros.report import sweeps
from irlpilco_ros.report.debris_figure import DEMONSTRATION, LEARNED, REPLAY
from irlpilco_ros.report.resimulation import Film
from irlpilco_ros.report.run_summary import RunSummary
from irlpilco_ros.report.sweeps import SimulatedSweeps, SweepJobs
from sim_bridge.errors import RenderingError
from sim_bridge.guided_motion import GuidedMotion

FILM = Film(np.zeros((2, 4, 4, 3), dtype=np.uint8), np.array([0.0, 0.1]))
RUN = summary(("left_s0", "right_w2"))


class AtOnce(Executor):
    """Does everything when it is asked to, in this process."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **_: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(function(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future


def raising(error: Exception) -> Callable[..., Any]:
    def function(*_: Any) -> Any:
        raise error

    return function


def simulate(run: RunSummary) -> SimulatedSweeps:
    return SweepJobs.submit(run, AtOnce()).results(lambda fraction: None)


@pytest.fixture(autouse=True)
def seen(monkeypatch: pytest.MonkeyPatch) -> list[tuple[float, int]]:
    """Stand in for the simulation; remember where each motion ended, and the seeds."""
    calls: list[tuple[float, int]] = []

    def count(motion: GuidedMotion, seed: int) -> int:
        calls.append((float(motion.at(motion.duration)[0][0]), seed))
        return seed

    monkeypatch.setattr(sweeps, "count_debris", count)
    monkeypatch.setattr(sweeps, "film", lambda motion, seed: FILM)
    return calls


def test_all_three_motions_are_swept_through_the_same_scatterings(seen: list) -> None:
    result = simulate(RUN)
    assert result.debris is not None
    assert list(result.debris.counts) == [DEMONSTRATION, REPLAY, LEARNED]
    assert len(sweeps.DEBRIS_SEEDS) >= 5
    ends = (RUN.demonstration[-1, 0], RUN.replay[-1, 0], RUN.best.trial[-1, 0])
    expected = [(end, seed) for end in ends for seed in sweeps.DEBRIS_SEEDS]
    np.testing.assert_allclose(seen, expected, atol=2e-3)
    assert list(result.debris.counts[REPLAY]) == list(sweeps.DEBRIS_SEEDS)
    assert list(result.films) == ["demonstration", "trial 0"]
    assert result.notes == ()


def test_run_without_replay(seen: list) -> None:
    result = simulate(dataclasses.replace(RUN, replay=None))
    assert result.debris is not None
    assert list(result.debris.counts) == [DEMONSTRATION, LEARNED]


def test_one_arm_is_shown_but_sweeps_nothing(seen: list) -> None:
    result = simulate(summary(("left_s0", "left_w2")))
    assert list(result.films) == ["demonstration", "trial 0"]
    assert result.debris is None
    assert result.notes == ()
    assert seen == []


def test_another_robot_is_not_simulated(seen: list) -> None:
    result = simulate(summary(("shoulder", "elbow")))
    assert seen == []
    assert result == SimulatedSweeps(notes=(sweeps.NOT_THIS_ROBOT,))


def test_without_opengl_the_debris_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweeps, "film", raising(RenderingError("install libegl1")))
    result = simulate(RUN)
    assert result.films == {}
    assert result.debris is not None
    assert len(result.notes) == 1
    assert "install libegl1" in result.notes[0]


def test_without_mujoco_there_is_a_note(monkeypatch: pytest.MonkeyPatch) -> None:
    missing = raising(ModuleNotFoundError("No module named 'mujoco'"))
    monkeypatch.setattr(sweeps, "film", missing)
    monkeypatch.setattr(sweeps, "count_debris", missing)
    assert simulate(RUN) == SimulatedSweeps(notes=(sweeps.NO_MUJOCO,))
