"""What the learner takes for its demonstration, over DDS."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import toy_robot
from test_learner import Workplace

from irlpilco_ros.experience.bag_reader import read_bag
from irlpilco_ros.experience.trajectory_bag import write_trajectory

pytestmark = pytest.mark.dds


def changed(keep=slice(None), **arrays):
    """The toy robot's demonstration with some of its samples, or with other values."""
    shown = dataclasses.replace(toy_robot.demonstrated(), **arrays)
    names = ("stamps", "positions", "velocities", "commands")
    return dataclasses.replace(shown, **{name: getattr(shown, name)[keep] for name in names})


def set_demonstration(place, bag):
    return place.graph.set_parameters(f"{place.namespace}/learner", {"demonstration": str(bag)})


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        (changed(slice(4)), "the horizon of 6 decisions takes 3 s, but it shows 1.5 s of motion"),
        (changed(positions=50.0 * toy_robot.demonstrated().positions), "in degrees"),
        (changed([0, 1, 2, 5, 6]), "no sample came for 1.500 s"),
        (changed(positions=np.full((7, 2), 0.1)), "nothing moves in its 3.0 s"),
    ],
)
def test_a_refused_demonstration_leaves_the_run_and_the_next_one_is_taken(
    shared_ros, tmp_path, request, wrong, reason
):
    namespace = f"/refused{request.node.callspec.indices['wrong']}"
    place = Workplace(shared_ros, tmp_path, namespace)
    refused = set_demonstration(place, write_trajectory(tmp_path / "wrong", wrong))
    assert not refused.successful
    assert reason in refused.reason
    assert not place.run.path.exists()
    good = toy_robot.record_demonstration(tmp_path / "good")
    assert set_demonstration(place, good).successful
    answer = shared_ros.trigger(f"{namespace}/learn_iteration")
    assert answer.success, answer.message
    assert place.robot.parameters["controller"]["trial_horizon"] == toy_robot.HORIZON


def test_until_a_trial_was_recorded_another_demonstration_is_taken(shared_ros, tmp_path):
    place = Workplace(shared_ros, tmp_path, "/another")
    first, second, third = (
        toy_robot.record_demonstration(tmp_path / "shown", seed) for seed in (1, 2, 3)
    )
    place.robot.refuse["controller/move_to_start"] = "not today"
    assert set_demonstration(place, first).successful
    assert "not today" in shared_ros.trigger("/another/learn_iteration").message
    assert set_demonstration(place, second).successful
    assert shared_ros.trigger("/another/learn_iteration").success
    taken = place.run.path / "demonstration"
    np.testing.assert_array_equal(read_bag(taken).positions, read_bag(second).positions)
    kept = place.run.path / "demonstration.replaced"
    np.testing.assert_array_equal(read_bag(kept).positions, read_bag(first).positions)
    refused = set_demonstration(place, third)
    assert not refused.successful
    assert "was begun with another demonstration" in refused.reason
    assert shared_ros.trigger("/another/learn_iteration").success


def test_a_wrong_demonstration_is_refused_at_the_start(shared_ros, tmp_path):
    wrong = write_trajectory(tmp_path / "wrong", changed(slice(3)))
    learner = shared_ros.start(
        "irlpilco_ros.nodes.learner",
        parameters={"run_directory": str(tmp_path / "run"), "demonstration": str(wrong)},
        files=[_robot_file(tmp_path)],
        namespace="/start",
        wait=False,
    )
    learner.expected_code = 1
    assert learner.wait() == 1
    assert f"the demonstration {wrong} is refused: the horizon of 6 decisions" in learner.output
    assert not (tmp_path / "run").exists()


def test_a_run_with_a_wrong_demonstration_and_no_trial_waits_for_another(shared_ros, tmp_path):
    """As an earlier version left it: the copy was made before anybody looked."""
    write_trajectory(tmp_path / "run", changed(slice(3)))
    (tmp_path / "run" / "000").rename(tmp_path / "run" / "demonstration")
    place = Workplace(shared_ros, tmp_path, "/waiting")
    shared_ros.wait_for(
        lambda: "the horizon of 6 decisions" in place.learner.output, "what is wrong with it"
    )
    good = toy_robot.record_demonstration(tmp_path / "good")
    assert set_demonstration(place, good).successful
    answer = shared_ros.trigger("/waiting/learn_iteration")
    assert answer.success, answer.message


def _robot_file(folder):
    path = folder / "robot.yaml"
    path.write_text(toy_robot.ROBOT_FILE)
    return path
