"""The short version of the study of other places: one seed, one iteration, a place or two."""

import dataclasses

import numpy as np
import pytest

from irlpilco_ros import cli
from irlpilco_ros.kinematics.rigid_motion import inverse
from irlpilco_ros.learning import LearningLoop
from irlpilco_ros.studies.baxter import motion_bench, movement_primitive, places
from irlpilco_ros.studies.baxter.carried_baselines import baselines_job
from irlpilco_ros.studies.baxter.places_bench import (
    COUNT,
    WIDEST,
    WIDEST_TURN,
    PlacesBench,
    drawn_places,
    places_from,
)
from irlpilco_ros.studies.result_store import ResultStore
from sim_bridge.pile import SHOWN, pile_pose

pytestmark = pytest.mark.slow

THERE = ((0.05, -0.03, 0.2), (-0.02, 0.03, -0.1))


@pytest.fixture(scope="module")
def bench():
    return PlacesBench("default", 0)


@pytest.fixture(scope="module")
def swept():
    job = places.places_job("default", 0, iterations=1, places=THERE, practised=1, watched=1)
    return job.compute([])


def test_places_are_one_list_that_begins_elsewhere_with_every_seed():
    drawn = drawn_places()
    assert len(set(drawn)) == COUNT
    assert np.abs(drawn).max(axis=0) == pytest.approx((WIDEST, WIDEST, WIDEST_TURN), rel=0.1)
    jobs = [places.places_job("default", seed).arguments["places"] for seed in range(4)]
    assert all(len(set(each)) == len(each) == COUNT for each in jobs)
    practised = [set(each[: places.PRACTISED]) for each in jobs]
    assert set.union(*practised) == set(drawn)
    assert places_from(3)[0] == drawn[3]


def test_without_a_trial_there_it_is_nearer_than_replay_and_with_one_nearer_still(swept):
    first, second = swept["places"]
    assert "after_one" not in first
    assert second["at_once"]["path"] < 0.012
    assert second["after_one"]["path"] < 0.6 * second["at_once"]["path"]
    assert [len(trials) for trials in swept["practised"]] == [1]
    later = swept["practised"][0][0]
    assert later["path"] != second["at_once"]["path"]  # it has learned from the trial elsewhere
    for trial in (second["at_once"], second["after_one"], later):
        assert 0.0 < trial["predicted"] < 0.02
        assert trial["seconds"] > 0.0
        assert 0 <= trial["pieces"] <= 20


def test_what_squared_exponentials_made_of_one_motion_is_not_carried_over():
    """Five trials at home, then the far ends: with it, 18 and 8 mrad there."""
    far = PlacesBench("miscalibrated", 0)
    settings = dataclasses.replace(motion_bench.sweep_settings(), seed=0, threads=1)
    learner = places.Traveller(far, LearningLoop(far.home.task, settings))
    for _ in range(5):
        learner.at_home()
    spots, refused = far.spots([(0.038, 0.079, -0.282), (0.018, -0.08, 0.246)])
    assert not refused
    for spot in spots:
        assert learner.copy().at_once(spot)["path"] < 0.006


def test_baselines_are_carried_over_by_the_same_kinematics():
    result = baselines_job("default", 0, iterations=3, places=THERE[:1]).compute([])
    errors = {name: trials[0]["path"] for name, trials in result.items()}
    assert errors["iterative_alone"] < errors["tracking"] < errors["replay"] < 0.04
    assert errors["iterative_with_pd"] < errors["tracking"]
    assert ("primitive" in errors) == movement_primitive.installed()


def test_a_primitive_starts_and_ends_where_the_object_has_gone(bench):
    pytest.importorskip("movement_primitives")
    spot = bench.at(THERE[0])
    carrier, path = bench.carrier, bench.home.shown.path
    paths = movement_primitive.tool_paths(carrier, path, spot.move)
    for sample in (0, -1):
        wanted = spot.move @ carrier.kinematics.poses(path.positions[sample])
        np.testing.assert_allclose(paths[sample], wanted, atol=2e-3)
    at_home = movement_primitive.tool_paths(carrier, path, np.eye(4))
    shown = np.stack([carrier.kinematics.poses(positions) for positions in path.positions])
    off = np.linalg.norm(at_home[..., :3, 3] - shown[..., :3, 3], axis=-1)
    assert np.sqrt(np.mean(off**2)) < 0.004  # where nothing moved it is what was shown
    states = movement_primitive.joint_states(carrier, path, spot)
    joints = states.shape[1] // 2
    reached = carrier.kinematics.poses(states[0, :joints])
    np.testing.assert_allclose(reached, paths[0], atol=2e-3)


def test_what_is_measured_is_how_far_it_is_from_what_was_carried_over(bench):
    spot = bench.at(THERE[0])
    assert spot.measure.of(spot.shown)["path"] == 0.0
    at_home = spot.measure.of(bench.home.shown)
    assert at_home["path"] > 0.02
    assert min(at_home["tools"]) > 0.03
    np.testing.assert_allclose(spot.move, pile_pose(THERE[0]) @ inverse(SHOWN))


def test_a_place_out_of_reach_is_left_out(bench):
    spots, refused = bench.spots([THERE[0], (0.6, 0.0, 0.0)])
    assert [spot.place for spot in spots] == [THERE[0]]
    assert refused[0]["place"] == [0.6, 0.0, 0.0]
    assert "out of reach" in refused[0]["reason"]


def trial(path, pieces=20, tool=2.0):
    tools = [tool * path, 2.0 * tool * path]
    return {"path": path, "tools": tools, "pieces": pieces, "predicted": path, "seconds": 3.0}


def run(path, pieces=20):
    rows = [{"place": [0.0, 0.0, 0.1], "at_once": trial(path, pieces)} for _ in range(3)]
    rows[1]["after_one"] = trial(0.4 * path)
    return {
        "home": trial(0.001),
        "places": rows,
        "practised": [[trial(0.7 * path)], [trial(0.5 * path)]],
    }


@pytest.fixture
def store(tmp_path):
    """Two seeds on the default robot, one of them with pieces lost; baselines of one."""
    store = ResultStore(tmp_path)
    store.write(places.places_job("default", 0), run(0.006))
    refused = [{"place": [0.1, 0.0, 0.3], "reason": "left_w0 would be too fast"}]
    store.write(places.places_job("default", 1), {**run(0.009, 17), "refused": refused})
    carried = {
        "replay": [trial(0.02), None],
        "tracking": [trial(0.01), trial(0.012)],
        "iterative_alone": [trial(0.005), trial(0.006)],
        "iterative_with_pd": [trial(0.02), trial(0.03)],
    }
    store.write(baselines_job("default", 0), carried)
    return store


def table(store, capsys):
    words = ["study", "baxter", "--experiments", "places", "--seeds", "2", "--tables-only"]
    assert cli.main([*words, "--out", str(store.folder)]) == 0
    return capsys.readouterr().out


def test_table_of_places_and_its_bars(store, capsys):
    text = table(store, capsys)
    assert "| default: replay | 20.0 | 40.0 | 80.0 | 20 | 1 of 2, 1 stopped |" in text
    assert "| default: learned, at once | 7.5 (6.0 to 9.0) |" in text
    assert "| default: at once, path, median [mrad] | ≤ 8 | 7.5 (6.0 to 9.0) | yes |" in text
    never = "never visited, after trials at 5 others, path, median [mrad]"
    assert f"| default: {never} | ≤ 4 |  |  |" in text
    assert "| default: at once, pieces in the pan, median | ≥ 20 | 18.5 (17 to 20) | no |" in text
    assert "| default: at once, places with ≥ 18 pieces | ≥ 90% | 50% | no |" in text
    assert "| miscalibrated: at once, path, median [mrad] | ≤ 12 |  |  |" in text
    assert "| default | 7.5 (6.0 to 9.0) | 5.2 (4.2 to 6.3) | 3.8 (3.0 to 4.5) | 2 |" in text
    assert movement_primitive.MISSING in text
    assert "Refused: 1 of 7 places, such as (0.1, 0) m, 0.3 rad: left_w0 would be too fast." in text
    assert "3 of 8 runs." in text


def test_where_a_baseline_wins_is_said(store, capsys):
    text = table(store, capsys)
    assert "default, iterative control against learned, at once: 5.5 against 7.5 mrad" in text
    assert "PD tracking against" not in text


def test_figure_of_the_places_practised(store, capsys):
    table(store, capsys)
    figure = (store.folder / "figures" / "places.svg").read_text()
    assert "learned, at once" in figure
    assert "default, 2 seeds" in figure
    assert "iterative control and PD" in figure
    assert "movement primitive" not in figure
