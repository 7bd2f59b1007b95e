"""The short version of the comparison with MC-PILCO, and its cost."""

import dataclasses
import json

import numpy as np
import pytest

from irlpilco_ros import cli
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.studies.cart_pole import mc_pilco
from irlpilco_ros.studies.cart_pole.either_side import either_side_loss
from irlpilco_ros.studies.cart_pole.experiments import EXPERIMENTS
from irlpilco_ros.studies.job import FAILED
from irlpilco_ros.studies.result_store import ResultStore

PRECISION = np.diag(2.0 / mc_pilco.LENGTHS**2)


def states_of(seed, count=3):
    """Means near 0, where both sides count, and covariances."""
    rng = np.random.default_rng(seed)
    roots = 0.6 * rng.standard_normal((count, 2, 2))
    return Gaussian(rng.standard_normal((count, 2)), roots @ roots.swapaxes(1, 2))


def test_the_loss_is_the_published_one_expected():
    states, rng = states_of(0), np.random.default_rng(1)
    values = either_side_loss(states, mc_pilco.TARGET, PRECISION)[0]
    for mean, covariance, value in zip(states.mean, states.covariance, values, strict=True):
        x, theta = rng.multivariate_normal(mean, covariance, 200_000).T
        samples = 1.0 - np.exp(-(((np.abs(theta) - np.pi) / 3.0) ** 2) - x**2)
        assert value == pytest.approx(samples.mean(), abs=5.0 * samples.std() / np.sqrt(200_000))


def test_the_slopes_of_the_loss_are_those_of_differences():
    states, h = states_of(2), 1e-5
    _, by_mean, by_covariance = either_side_loss(states, mc_pilco.TARGET, PRECISION)
    rng = np.random.default_rng(3)
    step, turn = rng.standard_normal((3, 2)), rng.standard_normal((3, 2, 2))
    turn = turn + turn.swapaxes(1, 2)
    ends = [
        either_side_loss(
            Gaussian(states.mean + d * step, states.covariance + d * turn),
            mc_pilco.TARGET,
            PRECISION,
        )[0]
        for d in (-h, h)
    ]
    wanted = (by_mean * step).sum(axis=1) + (by_covariance * turn).sum(axis=(1, 2))
    assert (ends[1] - ends[0]) / (2.0 * h) == pytest.approx(wanted, rel=1e-6)


def test_a_certain_state_costs_the_same_on_either_side():
    certain = Gaussian(np.array([[0.2, 3.0], [0.2, -3.0]]), np.zeros((2, 2, 2)))
    values, *slopes = either_side_loss(certain, mc_pilco.TARGET, PRECISION)
    expected = 1.0 - np.exp(-(((3.0 - np.pi) / 3.0) ** 2) - 0.04)
    assert values == pytest.approx([expected, expected], rel=1e-12)
    assert all(np.isfinite(slope).all() for slope in slopes)


def test_success_is_all_of_the_last_second_on_either_side():
    states = np.zeros((mc_pilco.HORIZON + 1, 4))
    states[40:, 1] = -np.deg2rad(171.0)
    states[40:, 0] = 0.09
    assert mc_pilco.succeeded(states)
    for entry, value in ((0, 0.11), (1, np.deg2rad(191.0)), (1, np.deg2rad(540.0))):
        off = states.copy()
        off[40, entry] = value
        assert not mc_pilco.succeeded(off)
    states[39] = 0.0
    assert mc_pilco.succeeded(states)


def test_a_run_tells_of_every_trial(monkeypatch):
    """The first and one that is learned, both shorter than they are."""
    monkeypatch.setattr(mc_pilco, "TRIALS", 1)
    monkeypatch.setattr(mc_pilco, "HORIZON", 24)
    short = dataclasses.replace(mc_pilco.SETTINGS, evaluations=2, options={"rbf.count": 4})
    result = mc_pilco.learn_swing_up(dataclasses.replace(short, seed=3))
    assert json.loads(json.dumps(result)) == result
    first, second = result["rows"]
    assert first["predicted"] is None
    assert second["predicted"] > 0.0
    assert [each["succeeded"] for each in (first, second)] == [False, False]
    assert first["angle"] > 1.0 > first["position"] > 0.0
    assert 0.0 < first["cost"] < 24.0
    assert 0.0 <= first["cpu_seconds"] < second["cpu_seconds"]


def row(succeeded, cpu_seconds):
    return {
        "succeeded": succeeded,
        "succeeded_as_measured": False,
        "cpu_seconds": cpu_seconds,
    }


def test_the_table_counts_seeds_and_those_that_failed(tmp_path, capsys):
    store = ResultStore(tmp_path)
    jobs = mc_pilco.jobs(range(4))
    held = [False, False, False, True, False, True]
    store.write(jobs[0], {"rows": [row(each, 10.0 * k) for k, each in enumerate(held)]})
    store.write(jobs[1], {"rows": [row(False, 20.0 * k) for k in range(6)]})
    store.write(jobs[2], {FAILED: "NumericalError: not finite"})
    words = ["study", "cart-pole", "--seeds", "4", "--tables-only", "--out", str(tmp_path)]
    assert cli.main(words) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "| has succeeded by then | 0 of 3 (0 %) | 0 of 3 (0 %) | 1 of 3 (33 %) |" in lines[4]
    assert lines[4].endswith("| 1 of 3 (33 %) | 1 of 3 (33 %) |")
    assert lines[5].endswith("| 1 of 3 (33 %) | 0 of 3 (0 %) | 1 of 3 (33 %) |")
    assert lines[7].endswith("| 75 (50 to 100) |")
    assert "3 of 4 runs. Failed: classical_pilco, seed 2: NumericalError" in "".join(lines)


def test_a_result_of_other_settings_is_not_this_ones(tmp_path, monkeypatch):
    store, (job,) = ResultStore(tmp_path), mc_pilco.jobs([0])
    store.write(job, {"rows": []})
    assert store.read(job) is not None
    other = dataclasses.replace(mc_pilco.SETTINGS, evaluations=101)
    monkeypatch.setattr(mc_pilco, "SETTINGS", other)
    assert store.read(mc_pilco.jobs([0])[0]) is None


def test_a_part_of_another_chapter_is_refused(tmp_path, capsys):
    words = ["study", "cart-pole", "--experiments", "places", "--out", str(tmp_path)]
    assert cli.main(words) != 0
    assert "places is no part of the chapter cart-pole" in capsys.readouterr().err


def test_the_page_has_a_place_for_every_table(repository):
    from irlpilco_ros.commands import study

    page = (repository / "docs/cart_pole.md").read_text(encoding="utf-8")
    assert tuple(EXPERIMENTS) == study.EXPERIMENTS["cart-pole"]
    for name in EXPERIMENTS:
        assert page.count(f"<!-- table: {name} -->") == 1
