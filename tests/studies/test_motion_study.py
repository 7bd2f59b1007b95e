"""The short version of the study of the motion: three iterations, three seeds, and a late robot."""

import copy

import numpy as np
import pytest

from irlpilco_ros import cli
from irlpilco_ros.experience.parameters_file import load_parameters_file
from irlpilco_ros.resources import config_file
from irlpilco_ros.studies.baxter import motion
from irlpilco_ros.studies.baxter.iterative_control import (
    GAINS,
    WAYS,
    best_iterative,
    improved,
    iterative_job,
)
from irlpilco_ros.studies.baxter.motion_bench import PERIOD, MotionBench, sweep_settings
from irlpilco_ros.studies.baxter.motion_tables import BARS, SLACK
from irlpilco_ros.studies.baxter.robots import ROBOTS
from irlpilco_ros.studies.result_store import ResultStore
from sim_bridge.servo_presets import SERVO_PRESETS

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", params=[("default", 3), ("delayed", 1)])
def learned(request):
    """Robot, and three iterations on it by some seeds."""
    robot, seeds = request.param
    jobs = [motion.motion_job(robot, seed, iterations=3) for seed in range(seeds)]
    return robot, [job.compute([]) for job in jobs]


def test_the_whole_path_is_learned(learned):
    robot, results = learned
    bars = [bar for bar in BARS if bar.robot == robot and bar.iteration <= 3]
    assert len(bars) >= 2
    for bar in bars:
        values = [bar.measure(result, result["rows"][bar.iteration]) for result in results]
        assert np.median(values) <= bar.limit, bar.what
        assert max(values) <= SLACK * bar.limit, bar.what


def test_replay_is_left_far_behind(learned):
    for result in learned[1]:
        assert result["rows"][3]["path"] < 0.1 * result["replay"]["path"]
        assert result["rows"][3]["largest"] < 0.2 * result["replay"]["largest"]
        assert max(result["rows"][3]["tools"]) < 0.3 * max(result["replay"]["tools"])


def test_every_trial_but_the_first_was_predicted(learned):
    result = learned[1][0]
    assert "coverage" not in result["rows"][0]
    for row in result["rows"][1:]:
        assert 0.5 < row["coverage"] <= 1.0
        assert 0.0 < row["prediction"] < 0.02
        assert row["seconds"] > 0.0


@pytest.fixture(scope="module")
def bench():
    return MotionBench("default", 1, PERIOD)


def test_what_was_shown_is_measured_against_itself(bench):
    shown = bench.measured(bench.shown)
    assert shown["ticks"] == shown["path"] == shown["largest"] == 0.0
    assert 1.0 < shown["acceleration_p99"] < shown["acceleration_max"] < 3.0
    assert bench.shown.path.times[-1] == pytest.approx(bench.task.horizon * bench.task.dt)


def test_iterative_control_makes_up_for_what_was_behind(bench):
    class Held:
        def __init__(self, speeds):
            self.speeds = speeds

        def act(self, _state, step):
            return self.speeds[step]

    speeds = bench.task.demonstrated_controls()
    first = bench.run(Held(speeds))
    second = bench.run(Held(improved(bench, speeds, first, 1.0)))
    errors = [bench.measured(trial)["path"] for trial in (first, second)]
    assert errors[1] < 0.7 * errors[0]


def test_settings_are_those_of_the_file():
    settings = sweep_settings()
    assert (settings.policy, settings.prior_mean) == ("smooth_phase", "identified")
    robot = load_parameters_file(config_file("sweep.yaml"), "learner")
    assert robot["control_period"] == PERIOD


def test_delayed_robots_are_late_and_those_miscalibrated_differ_by_the_seed():
    assert SERVO_PRESETS[ROBOTS["delayed_miscalibrated"](3).preset].servo_lag == 0.3
    assert ROBOTS["delayed"](3).effective_lag == ROBOTS["delayed_miscalibrated"](3).effective_lag
    assert len(ROBOTS["delayed"](3).speed_factor) == 1
    factors = [ROBOTS["delayed_miscalibrated"](seed).speed_factor for seed in (3, 4)]
    assert factors[0] == ROBOTS["miscalibrated"](3).speed_factor != factors[1]


def row(path, **changes):
    return {
        "ticks": path,
        "path": path,
        "largest": 4.0 * path,
        "acceleration_p99": 1.5,
        "acceleration_max": 4.0,
        "tools": [path, 2.0 * path],
        "seconds": 5.0,
        "coverage": 0.93,
        "prediction": path,
        **changes,
    }


def result(path):
    """A learning run whose path errors halve with every trial, down to `path` at the end."""
    rows = [row(path * 2.0 ** (7 - k)) for k in range(8)]
    return {"demonstration": row(0.0), "replay": row(0.02), "rows": rows}


def iterative(errors):
    """A run of iterative control: path errors of every gain, and half of these with PD."""
    alone = [[row(error) for error in each] for each in errors]
    with_pd = [[row(0.5 * error) for error in each] for each in errors]
    return dict(zip(WAYS, (alone, with_pd), strict=True))


def test_the_best_gain_counts_at_every_trial_and_one_that_was_stopped_does_not():
    errors = [[0.02, 0.003, 0.004], [0.02, 0.005, 0.001], [0.02, 0.002], [0.02], [0.02]]
    assert len(errors) == len(GAINS)
    runs = [iterative(errors), iterative(errors)]
    np.testing.assert_array_equal(best_iterative(runs, "alone"), [[0.02, 0.002, 0.001]] * 2)
    np.testing.assert_array_equal(best_iterative(runs, "with_pd"), [[0.01, 0.001, 0.0005]] * 2)


@pytest.fixture
def store(tmp_path):
    """Two seeds on the default robot, one of them far off at the end; others on one seed."""
    store = ResultStore(tmp_path)
    for seed, path in enumerate((0.0001, 0.0019)):
        store.write(motion.motion_job("default", seed), result(path))
    store.write(motion.motion_job("delayed", 0), result(0.001))
    errors = [[0.02, 0.01, *[0.006] * 6], *[[0.03] * 8] * 4]
    for robot in ("default", "delayed"):
        store.write(iterative_job(robot, 0), iterative(errors))
    for job in motion.control_period_jobs(range(1)):
        if job.experiment == motion.CONTROL_PERIOD:
            store.write(job, result(0.003))
    return store


def table(store, name, capsys):
    words = ["study", "baxter", "--experiments", name, "--seeds", "2", "--tables-only"]
    assert cli.main([*words, "--out", str(store.folder)]) == 0
    return capsys.readouterr().out


def test_table_of_the_path_and_its_bars(store, capsys):
    text = table(store, "motion", capsys)
    assert "| default: learned | 128.0 (12.8 to 243.2) |" in text
    assert "| default: replay | 20.0 (20.0 to 20.0) |" in text
    assert "| delayed: iterative control | 20.0 | 10.0 | 6.0 |" in text
    assert "| default: path [mrad] at k = 7 | ≤ 1.2 | 1.0 (0.1 to 1.9) | 1 of 2 | no |" in text
    assert "| delayed: path [mrad] at k = 7 | ≤ 5 | 1.0 | 1 of 1 | yes |" in text
    assert "| miscalibrated: path [mrad] at k = 7 | ≤ 1.8 |  | 0 of 0 |  |" in text
    assert f"| delayed |{' 93.0 |' * 6} 93 to 93 | yes |" in text
    assert "5 of 16 runs." in text
    figure = (store.folder / "figures" / "motion.svg").read_text()
    assert "learned, 2 seeds" in figure
    assert figure.count("iterative control and PD") == 2


def test_a_band_that_holds_too_little_in_the_mean_is_not_called_true(store, capsys):
    run = copy.deepcopy(result(0.001))
    run["rows"][7]["coverage"] = 0.89
    store.write(motion.motion_job("delayed", 0), run)
    text = table(store, "motion", capsys)
    assert f"| delayed |{' 93.0 |' * 5} 89.0 | 89 to 93 | no |" in text


def test_where_iterative_control_is_better_is_said(store, capsys):
    text = table(store, "motion", capsys)
    assert "delayed at k = 2 (iterative control: 6.0 against 32.0 mrad)" in text
    assert "delayed at k = 7" not in text
    good = copy.deepcopy(result(1e-5))
    for robot, seed in (("default", 0), ("default", 1), ("delayed", 0)):
        store.write(motion.motion_job(robot, seed), good)
    text = table(store, "motion", capsys)
    assert (
        "on the robots default, delayed, has the smaller median error of the path: nowhere." in text
    )


def test_table_of_control_periods_begins_with_the_longest(store, capsys):
    text = table(store, "control_period", capsys)
    lines = [line for line in text.splitlines() if " Hz" in line]
    rates = ["| 2 Hz", "| 4 Hz", "| 10 Hz", "| 10 Hz, 200 points"]
    assert [line.split(" | ")[0] for line in lines] == rates
    small = motion.control_period_jobs(range(1))[-1].arguments["settings"]
    assert (small.model_points, sweep_settings().model_points) == (200, 300)
    assert lines[1].endswith("| 5 (5 to 5) | 2 |")
