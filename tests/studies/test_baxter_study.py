"""The short version of the chapter: one seed, two iterations."""

import dataclasses
import json

import numpy as np
import pytest

from irlpilco_ros import cli
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.studies.baxter import (
    hands,
    headline,
    perturbations,
    reading,
    reproduce,
    second_robot,
)
from irlpilco_ros.studies.baxter.debris import debris_run
from irlpilco_ros.studies.baxter.figures import write_figures
from irlpilco_ros.studies.baxter.learning_run import learned_policy, learning_job, thesis_settings
from irlpilco_ros.studies.baxter.reproduce_figures import cart_pole_errors
from irlpilco_ros.studies.baxter.results import EXPERIMENTS
from irlpilco_ros.studies.baxter.run_summary import summary_of
from irlpilco_ros.studies.result_store import ResultStore
from sim_bridge.joints import ARM_JOINTS

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


def test_the_path_is_measured_beside_the_decisions(learned):
    shown = learned["demonstration_path"]
    assert shown["rmse"] == shown["largest"] == 0.0
    for row in learned["rows"]:
        path = row["path"]
        assert 0.9 * row["rmse"] < path["rmse"] < path["largest"]
        assert shown["acceleration_p99"] < path["acceleration_max"]
    assert learned["rows"][2]["path"]["rmse"] < 0.5 * learned["replay_path"]["rmse"]
    summary = summary_of("run", learned)
    assert summary.path_is_known
    assert summary.demonstration_path.acceleration_p99 == shown["acceleration_p99"]


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
    figures = write_figures(
        store, range(1), tmp_path / "figures", tmp_path / "cart_pole", EXPERIMENTS
    )
    assert [path.name for path in figures] == ["robot_time.svg"]
    assert "joint error, RMS [rad]" in figures[0].read_text()
    # A document's figures of other parts stay as they are, whatever there is of them here.
    others = write_figures(store, range(1), tmp_path / "others", tmp_path, ["motion", "places"])
    assert not others


def sixteen_rows(learned):
    """As many as the thesis's runs have, from the few that there are."""
    return [learned["rows"][0], *learned["rows"][1:] * 8][: reproduce.ITERATIONS + 1]


def test_figures_and_table_of_the_thesis(learned, tmp_path, capsys):
    store = ResultStore(tmp_path / "study")
    rows = sixteen_rows(learned)
    for job in reproduce.jobs(range(2)):
        store.write(job, {**learned, "rows": rows})
    cart_pole = {"seed": 0, "method": "feature_matching", "error_6_1": 0.5}
    (tmp_path / "results.json").write_text(json.dumps({"rows": [cart_pole] * 3}))
    words = ["study", "baxter", "--experiments", "reproduce", "--seeds", "2", "--tables-only"]
    assert cli.main([*words, "--out", str(store.folder), "--cart-pole", str(tmp_path)]) == 0
    assert "| feature matching, thesis | " in capsys.readouterr().out
    figures = store.folder / "figures"
    joints = (figures / "joints_thesis.svg").read_text()
    assert all(f">{name.replace('_', ' ')}<" in joints for name in ARM_JOINTS)
    assert "± 2 standard" in joints
    left_w2 = (figures / "left_w2_default.svg").read_text()
    for method in ("matching", "expectations"):
        assert all(f"feature {method}, iteration {k}<" in left_w2 for k in (1, 7, 15))
    assert left_w2.count("replay") == 1
    methods = (figures / "methods.svg").read_text()
    assert methods.count("feature matching, 2 seeds") == 2
    assert methods.count("feature matching, 1 seed<") == 1
    assert "not measured" not in methods
    assert "mathdefault" not in methods  # a power of ten that nobody set


def test_without_a_cart_pole_its_panel_says_so(learned, tmp_path):
    store = ResultStore(tmp_path)
    store.write(reproduce.thesis_job("feature_matching", 0), learned)
    write_figures(store, range(1), tmp_path / "figures", tmp_path / "nowhere", EXPERIMENTS)
    assert (tmp_path / "figures/methods.svg").read_text().count("not measured") == 2


def test_of_the_cart_poles_seeds_those_with_all_iterations_count(tmp_path):
    rows = [
        {"method": method, "seed": seed, "iteration": k, "error_6_1": 0.1 * k + seed}
        for method, seed, count in (
            ("feature_matching", 0, 3),
            ("feature_matching", 1, 4),
            ("expert", 0, 9),
        )
        for k in range(count)
    ]
    (tmp_path / "results.json").write_text(json.dumps({"rows": rows}))
    errors = cart_pole_errors(tmp_path)
    assert set(errors) == {"feature_matching"}
    np.testing.assert_allclose(errors["feature_matching"], [[1.0, 1.1, 1.2, 1.3]])


def test_computing_and_robot_time_stand_beside_the_thesiss(learned, tmp_path):
    store = ResultStore(tmp_path)
    rows = [{**row, "model_seconds": 2.0, "policy_seconds": 3.0} for row in sixteen_rows(learned)]
    store.write(reproduce.thesis_job("feature_matching", 0), {**learned, "rows": rows})
    table = EXPERIMENTS["reproduce"].table(store, range(1))
    (line,) = [line for line in table.splitlines() if line.startswith("| feature matching, thesis")]
    assert line.endswith("| 128 | 80 | 1 |")
    assert "| feature expectations, reported | " in table
    assert "| 54000 |" in table


def test_seeds_within_the_bar_of_the_hands_are_counted(learned, tmp_path):
    store = ResultStore(tmp_path)
    for seed, brush_tip in enumerate((0.0049, 0.0051)):
        rows = [{**row, "hands": [0.001, brush_tip]} for row in sixteen_rows(learned)[:8]]
        store.write(hands.hands_job(headline.DEFAULT, seed), {**learned, "rows": rows})
    lines = EXPERIMENTS["hands"].table(store, range(2)).splitlines()
    (pan, brush) = (line for line in lines if line.startswith("| default, imitating hands"))
    assert pan.endswith("| 2 of 2 |")
    assert brush.endswith("| 1 of 2 |")


def test_a_row_has_the_prediction_for_its_trial(learned):
    first, last = learned["rows"][0], learned["rows"][-1]
    assert first["predicted"] is None
    trial, predicted = np.array(last["positions"]), np.array(last["predicted"]["mean"])
    assert predicted.shape == trial.shape == np.shape(last["predicted"]["deviation"])
    assert np.sqrt(np.mean((predicted - trial) ** 2)) < 0.02
    assert np.min(last["predicted"]["deviation"]) >= 0.0


def test_thesis_settings_are_those_of_the_file():
    settings = thesis_settings()
    assert (settings.prior_mean, settings.policy) == ("zero", "linear")
    assert settings.optimiser == "scaled_lbfgs"


def test_readings_of_the_thesis_that_came_to_the_bar_are_counted(learned, tmp_path):
    store = ResultStore(tmp_path)
    shown = np.array(learned["demonstration"])[:, :14]
    deviation = np.full_like(shown, 0.07).tolist()
    predicted = {"mean": (shown + 0.02).tolist(), "deviation": deviation}
    for job in reading.jobs(range(2), iterations=4):
        if job.condition == "lambda_1":
            errors = (0.06, 0.05, 0.02, 0.03, 0.04) if job.seed else [0.06] * 5
            rows = [
                {**row, "rmse": error, "predicted": predicted}
                for row, error in zip(sixteen_rows(learned), errors, strict=False)
            ]
            store.write(job, {**learned, "rows": rows})
            options = job.arguments["settings"].options
            assert options["feature_matching.variance_weight"] == 1.0
    table = EXPERIMENTS["reading"].learned(4).table(store, range(2))
    (line,) = [line for line in table.splitlines() if "lambda 1" in line]
    assert line.endswith("| 40 (20 to 60) | 1 of 2 | 20 (20 to 20) | 70 (70 to 70) |")


def test_a_spread_start_is_learned_for_where_it_is_asked_for():
    spread = {job.condition: job.arguments.get("start_spread") for job in reading.jobs(range(1))}
    assert {name for name, value in spread.items() if value} == {"starts_spread_by_0.03_rad"}


def test_another_number_of_iterations_is_a_study_of_its_own(learned, tmp_path, capsys):
    store = ResultStore(tmp_path)
    whole = reproduce.jobs(range(1))
    for job in whole + reproduce.jobs(range(1), iterations=2):
        store.write(job, {**learned, "rows": sixteen_rows(learned)[:3]})
    assert all(store.read(job) is not None for job in whole)
    words = ["study", "baxter", "--seeds", "1", "--iterations", "2", "--tables-only"]
    assert cli.main([*words, "--out", str(tmp_path), "--experiments", "reproduce"]) == 0
    said = capsys.readouterr().out
    assert "| k = 1 | k = 2 | robot time" in said
    assert "4 of 4 runs." in said
    assert cli.main([*words, "--out", str(tmp_path), "--experiments", "motion"]) == 1
    assert "reproduce or reading" in capsys.readouterr().err


def test_another_arm_learns_to_wipe_from_its_configuration_alone():
    settings = dataclasses.replace(LearningSettings(), threads=1)
    result = second_robot.wiping_run("miscalibrated", settings, iterations=2)
    assert result["rows"][2]["rmse"] < 0.2 * result["replay_rmse"]
