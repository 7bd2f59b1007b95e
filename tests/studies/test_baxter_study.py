"""The short version of the chapter: one seed, two iterations."""

import dataclasses

import numpy as np
import pytest

from irlpilco_ros import cli
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.studies.baxter import headline, perturbations, second_robot
from irlpilco_ros.studies.baxter.debris import debris_run
from irlpilco_ros.studies.baxter.figures import write_figures
from irlpilco_ros.studies.baxter.learning_run import learned_policy, learning_job, thesis_settings
from irlpilco_ros.studies.baxter.results import EXPERIMENTS
from irlpilco_ros.studies.result_store import ResultStore

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def learned():
    """Two iterations on the miscalibrated robot."""
    return learning_job("short", "miscalibrated", 0, "miscalibrated", iterations=2).compute([])


def test_learning_beats_replay_on_a_miscalibrated_robot(learned):
    errors = [row["rmse"] for row in learned["rows"]]
    assert learned["replay_rmse"] > 0.03
    assert errors[2] < 0.02
    assert errors[2] < 0.4 * learned["replay_rmse"]
    assert max(learned["rows"][2]["hands"]) < max(learned["replay_hands"])


def test_the_learned_policy_can_be_tried_on_a_perturbed_robot(learned):
    errors = perturbations.perturbation_run("push", 0, "defaults", [learned])
    assert set(errors) == {"replay", "tracking", "cloning", "defaults"}
    calm = perturbations.perturbation_run("none", 0, "defaults", [learned])
    assert errors["replay"] > 2.0 * calm["replay"]
    again = perturbations.perturbation_run("push", 0, "defaults", [learned])
    assert again == errors


def test_debris_is_counted_after_every_way_to_sweep(learned):
    counts = debris_run("default", 0, [learned])
    assert counts["demonstration"] >= 10
    assert set(counts) == {"demonstration", "replay", "tracking", "cloning", "learned"}


def test_a_result_survives_its_file(learned, tmp_path):
    store, job = ResultStore(tmp_path), headline.headline_job(headline.MISCALIBRATED, 0)
    store.write(job, learned)
    policy, again = learned_policy(learned), learned_policy(store.read(job))
    np.testing.assert_array_equal(policy.parameters, again.parameters)


def test_every_start_direction_lifts_both_tools():
    start = np.array([-0.14, -0.55, -0.96, 1.74, 1.01, 0.96, -0.74] * 2)
    direction = perturbations.start_direction(start, 3)
    assert np.sqrt(np.mean(direction**2)) == pytest.approx(1.0)


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_experiment_has_jobs_and_a_table_without_results(name, tmp_path):
    jobs = EXPERIMENTS[name].jobs(range(2))
    places = {ResultStore(tmp_path).path(job) for job in jobs}
    assert len(places) == len(jobs) > 0
    assert EXPERIMENTS[name].table(ResultStore(tmp_path), range(2)).startswith("| ")


def test_tables_and_figures_of_what_is_there(learned, tmp_path, capsys):
    store = ResultStore(tmp_path)
    rows = (learned["rows"] * 3)[:8]
    store.write(headline.headline_job(headline.DEFAULT, 0), {**learned, "rows": rows})
    words = ["study", "baxter", "--experiments", "headline", "--out", str(tmp_path)]
    assert cli.main([*words, "--seeds", "1", "--tables-only"]) == 0
    assert "| default | " in capsys.readouterr().out
    assert "1 of 3 runs." in (tmp_path / "tables.md").read_text()
    figures = write_figures(store, range(1), tmp_path / "figures")
    assert [path.name for path in figures] == ["robot_time.svg"]
    assert "joint error, RMS [rad]" in figures[0].read_text()


def test_thesis_settings_are_those_of_the_file():
    settings = thesis_settings()
    assert (settings.prior_mean, settings.policy, settings.optimiser) == ("zero", "linear", "lbfgs")


def test_another_arm_learns_to_wipe_from_its_configuration_alone():
    settings = dataclasses.replace(LearningSettings(), threads=1)
    result = second_robot.wiping_run("miscalibrated", settings, iterations=2)
    assert result["rows"][2]["rmse"] < 0.2 * result["replay_rmse"]
