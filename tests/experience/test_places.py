"""One run at several places: what is practised where, and what is on disk of it."""

from __future__ import annotations

import dataclasses
import shutil
from pathlib import Path

import numpy as np
import pytest
from practising_arm import (
    HORIZON,
    OBJECT,
    PERIOD,
    ROBOT,
    SETTINGS,
    practise,
    record_demonstration,
    record_trial,
    robot_file,
    way,
)

from irlpilco_ros.cli import main
from irlpilco_ros.commands.object_place import adapter_of, moved_to
from irlpilco_ros.experience.adapting import Adapter, AdaptSettings
from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.experience.best_trial import best_sentence, rows_here
from irlpilco_ros.experience.errors import BagError, RunDirectoryError
from irlpilco_ros.experience.object_pose import (
    decode_pose,
    displacement,
    encode_pose,
    recorded_object_pose,
    shifted,
)
from irlpilco_ros.experience.places import read_places
from irlpilco_ros.kinematics.errors import RobotDescriptionError, UnreachableError
from irlpilco_ros.kinematics.rigid_motion import pose
from irlpilco_ros.learning.errors import InvalidSettingError, IrlPilcoError
from irlpilco_ros.learning.settings import values_of

PLACE = (-0.05, 0.04, 0.2)


@pytest.fixture(scope="module")
def begun(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of three trials where it was shown."""
    folder = tmp_path_factory.mktemp("begun")
    robot_file(folder)
    run = Apprenticeship.open(
        folder / "run", record_demonstration(folder / "shown"), ROBOT, SETTINGS
    )
    practise(run, 3)
    run.close()
    shutil.copytree(folder / "run" / "trials" / "001", folder / "saved")
    return folder


@pytest.fixture
def folder(begun: Path, tmp_path: Path) -> Path:
    shutil.copytree(begun, tmp_path / "copy")
    return tmp_path / "copy"


def adapter(folder: Path, limit: float = 0.02, speed: float = 1.0) -> Adapter:
    return adapter_of(folder / "arm.yaml", values_of(ROBOT), AdaptSettings(limit, speed))


def opened(folder: Path) -> Apprenticeship:
    return Apprenticeship.open(folder / "run", None, ROBOT, SETTINGS)


def files(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted((folder / "run").rglob("*"))
        if path.is_file() and path.name != ".lock"
    }


def test_a_run_goes_on_at_another_place_and_is_taken_up_there(folder):
    run = opened(folder)
    shown = run.task
    adapted, sentence = adapter(folder).adapt(run, moved_to(PLACE))
    assert (adapted.number, adapted.plan.iteration.index) == (1, 3)
    assert "moved by (-0.050, 0.040) m and 0.200 rad" in sentence
    assert 0.0 < adapted.forecast.total < 0.02
    start = adapted.plan.parameters["start_position"]
    assert np.abs(np.subtract(start, way(np.zeros(1))[0][0])).max() > 0.05
    assert run.task is not shown
    # At once it is much nearer to what is to be done there than what was demonstrated is.
    report = run.finish(record_trial(adapted.plan, run.directory.trials_directory))
    assert report.row.rmse_rad < 0.02
    assert report.row.path_rmse_rad < 0.02
    run.prepare()
    proposed = run.directory.read_iteration(4)
    run.close()

    again = opened(folder)
    assert again.next_index == 4
    np.testing.assert_allclose(
        again.task.reference_states(), run.task.reference_states(), atol=1e-12
    )
    np.testing.assert_array_equal(
        again.prepare().iteration.policy.parameters, proposed.policy.parameters
    )
    (error,) = practise(again, 1)
    assert error < 0.02
    again.close()
    rows = again.directory.metrics()
    assert [row.iteration for row in rows] == [0, 1, 2, 3, 4]


def test_back_where_it_was_shown_it_is_the_demonstration_again(folder):
    run = opened(folder)
    shown = run.task
    adapter(folder).adapt(run, moved_to(PLACE))
    elsewhere = run.task
    practise(run, 1)
    adapted, _ = adapter(folder).adapt(run, moved_to((0.0, 0.0, 0.0)))
    assert run.task is shown
    assert adapted.number == 2
    adapter(folder).adapt(run, moved_to(PLACE))
    assert run.task is elsewhere
    run.close()
    again = opened(folder)
    practices = again._practices
    assert [each.task is practices[0].task for each in practices] == [True, False, True, False]
    assert practices[3].task is practices[1].task
    again.close()


def test_the_best_trial_is_the_best_where_the_object_is(folder):
    run = opened(folder)
    best_policy, directory = run.directory.best_policy_file, run.directory
    at_home = best_policy.read_bytes()
    adapter(folder).adapt(run, moved_to(PLACE))
    assert best_sentence(directory).startswith("best: no trial has been judged yet where the obj")
    assert best_policy.read_bytes() == at_home
    practise(run, 1)
    rows = directory.metrics()
    assert rows[3].mse > min(row.mse for row in rows[:3])  # at home it went better
    assert best_policy.read_text().startswith("# iteration 3, trial 003,")
    assert best_sentence(directory).startswith("best: iteration 3, ")
    adapter(folder).adapt(run, moved_to((0.0, 0.0, 0.0)))
    run.close()
    opened(folder).close()
    assert best_policy.read_bytes() == at_home
    back = opened(folder)
    adapter(folder).adapt(back, moved_to(PLACE))
    back.close()
    assert [row.iteration for row in rows_here(directory)] == [3]


def test_a_trial_that_was_made_and_not_judged_is_judged_where_it_was_made(folder):
    run = opened(folder)
    adapted, _ = adapter(folder).adapt(run, moved_to(PLACE))
    record_trial(adapted.plan, run.directory.trials_directory)
    run.close()
    again = opened(folder)
    assert again.next_index == 4
    assert again.directory.metrics()[-1].rmse_rad < 0.02
    again.close()


def test_what_was_proposed_elsewhere_and_not_tried_is_dropped(folder):
    run = opened(folder)
    there = run.prepare().iteration.policy.parameters
    adapted, _ = adapter(folder).adapt(run, moved_to(PLACE))
    run.close()
    found = run.directory.read_iteration(3).policy.parameters
    np.testing.assert_array_equal(found, adapted.plan.iteration.policy.parameters)
    assert np.abs(found - there).max() > 0.0


def test_killed_between_place_and_policy_it_adapts_again(folder):
    run = opened(folder)
    adapted, _ = adapter(folder).adapt(run, moved_to(PLACE))
    run.close()
    run.directory.iteration_file(3).unlink()
    again = opened(folder)
    np.testing.assert_allclose(
        again.prepare().iteration.policy.parameters,
        adapted.plan.iteration.policy.parameters,
        atol=1e-9,
    )
    again.close()


@pytest.mark.parametrize(
    ("place", "limit", "error", "words"),
    [
        ((0.5, 0.0, 0.0), 0.02, UnreachableError, "pen is out of reach"),
        (PLACE, 1e-5, UnreachableError, "does not vouch .* adapt_error_limit, 1e-05 rad"),
    ],
)
def test_what_is_refused_leaves_everything_as_it_was(folder, place, limit, error, words):
    before, run = files(folder), opened(folder)
    task = run.task
    with pytest.raises(error, match=words):
        adapter(folder, limit).adapt(run, moved_to(place))
    assert run.task is task
    run.close()
    assert files(folder) == before


def test_before_any_trial_it_begins_there_with_the_initial_policy(begun, tmp_path):
    run = Apprenticeship.open(tmp_path / "run", begun / "shown" / "000_with_pose", ROBOT, SETTINGS)
    adapted, sentence = adapter(begun).adapt(run, moved_to(PLACE))
    assert adapted.plan.iteration.index == 0
    assert "nothing is predicted" in sentence
    errors = practise(run, 3)
    assert errors[-1] < 0.3 * errors[0]
    run.close()
    # From now on the demonstration stays what it is.
    assert run.directory.has_learned()


def test_without_tools_or_a_known_object_it_says_what_is_missing(folder, tmp_path):
    run, known = opened(folder), adapter(folder)
    blind = dataclasses.replace(known, tools=dataclasses.replace(known.tools, urdf=""))
    with pytest.raises(RobotDescriptionError, match="urdf is not set"):
        blind.adapt(run, moved_to(PLACE))
    run.close()
    plain = record_demonstration(tmp_path / "plain", None)
    run = Apprenticeship.open(tmp_path / "run", plain, ROBOT, SETTINGS)
    with pytest.raises(BagError, match="set object_pose in the robot's file"):
        known.adapt(run, moved_to(PLACE))
    objects = dataclasses.replace(known.objects, object_pose=(0.5, 0.4, 0.0, 0.0, 0.0, 0.2))
    adapted, _ = dataclasses.replace(known, objects=objects).adapt(run, moved_to(PLACE))
    assert adapted.number == 1
    run.close()
    with pytest.raises(InvalidSettingError, match="x, y, z"):
        dataclasses.replace(known.objects, object_pose=(0.5, 0.4))


def blind(folder: Path, speed: float) -> Adapter:
    """Return what adapts a robot of which nobody knows where its tools are."""
    known = adapter(folder, speed=speed)
    return dataclasses.replace(known, tools=dataclasses.replace(known.tools, urdf=""))


@pytest.mark.parametrize(("speed", "horizon"), [(1.25, 7), (0.75, 11)])
def test_another_speed_needs_neither_tools_nor_an_object(folder, speed, horizon):
    run = opened(folder)
    shown, seconds = run.task, run.directory.metrics()[-1].robot_time_s
    adapted, sentence = blind(folder, speed).adapt(run, None)
    assert f"place 1, where it was shown, at {speed:g} times the shown speed" in sentence
    assert (run.speed, run.task.horizon) == (speed, horizon)
    assert adapted.plan.parameters["trial_horizon"] == horizon
    assert run.object_pose is None
    errors = practise(run, 2)
    assert errors[0] < 0.02
    rows = run.directory.metrics()
    assert rows[3].path_rmse_rad < 0.02  # against what was shown, at that speed
    assert rows[3].robot_time_s == pytest.approx(seconds + horizon * PERIOD)
    run.prepare()
    run.close()
    assert [place.speed for place in read_places(folder / "run" / "places")] == [speed]

    again = opened(folder)
    assert (again.next_index, again.speed) == (5, speed)
    assert [row.iteration for row in rows_here(again.directory)] == [3, 4]
    assert again.prepare().parameters["trial_horizon"] == horizon
    # And back at the speed that was shown: the demonstration itself, and its trials are the best.
    blind(folder, 1.0).adapt(again, None)
    assert again.task is not shown
    assert again.task.horizon == HORIZON
    assert practise(again, 1)[0] < 0.02
    assert [row.iteration for row in rows_here(again.directory)] == [0, 1, 2, 5]
    again.close()
    opened(folder).close()


def test_place_and_speed_go_together_and_stay_until_they_are_changed(folder):
    run = opened(folder)
    adapter(folder, speed=1.25).adapt(run, moved_to(PLACE))
    fast = run.task
    assert practise(run, 1)[0] < 0.02
    adapter(folder).adapt(run, None)  # the same place, as fast as it was shown
    assert (run.speed, run.task.horizon) == (1.0, HORIZON)
    np.testing.assert_allclose(
        run.task.reference_states()[0, :3], fast.reference_states()[0, :3], atol=1e-3
    )
    assert best_sentence(run.directory).startswith("best: no trial has been judged yet")
    adapter(folder, speed=1.25).adapt(run, None)
    assert run.task is fast
    run.close()
    again = opened(folder)
    assert again._practices[3].task is again._practices[1].task
    assert again._practices[2].task is not again._practices[1].task
    again.close()


def test_trials_of_two_speeds_that_were_made_and_not_judged_are_found_again(folder):
    run = opened(folder)
    lost = run.prepare()
    record_trial(lost, run.directory.trials_directory)  # 003, as shown; never judged
    run.close()
    run = opened(folder)
    adapted, _ = blind(folder, 1.25).adapt(run, None)
    record_trial(adapted.plan, run.directory.trials_directory)
    run.close()
    shutil.rmtree(folder / "run" / "trials" / "001")
    again = opened(folder)  # from iteration 1 on all is judged anew, once that has been done
    assert again.next_index == 1
    assert any("is lost" in note for note in again.notes)
    again.close()
    shutil.copytree(folder / "saved", folder / "run" / "trials" / "007")
    whole = opened(folder)
    assert whole.next_index == 5
    rows = whole.directory.metrics()
    assert [row.iteration for row in rows] == [0, 1, 2, 3, 4]
    assert rows[4].rmse_rad < 0.02
    whole.close()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"command_interface": "effort", "effort_limit": (1.0,) * 3}, "set speed to 1"),
        ({"velocity_limit": (0.4,) * 3}, "that is at speed 1.25; a lower one may do"),
    ],
)
def test_a_speed_that_cannot_be_is_refused_and_leaves_everything_as_it_was(folder, change, words):
    before, run = files(folder), opened(folder)
    robot = dataclasses.replace(ROBOT, **change)
    run._robot = robot
    with pytest.raises(IrlPilcoError, match=words):
        dataclasses.replace(adapter(folder, speed=1.25), robot=robot).adapt(run, None)
    run.close()
    assert files(folder) == before
    with pytest.raises(InvalidSettingError, match=r"speed is 1\.6"):
        AdaptSettings(speed=1.6)


def test_a_damaged_place_is_named(folder):
    run = opened(folder)
    adapter(folder).adapt(run, moved_to(PLACE))
    run.close()
    path = folder / "run" / "places" / "001.npz"
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(RunDirectoryError, match=r"places/001\.npz"):
        opened(folder)


def test_the_command_line_adapts_a_run(folder, capsys):
    robot = ["--robot", str(folder / "arm.yaml")]
    place = ["--object-pose", *map(str, PLACE)]
    assert main(["adapt", str(folder / "run"), *place, *robot]) == 0
    said = capsys.readouterr().out
    assert "place 1" in said
    assert str(folder / "run" / "policy_003.yaml") in said
    assert len(read_places(folder / "run" / "places")) == 1
    assert main(["adapt", str(folder / "run"), "--object-pose", "0.5", "0", "0", *robot]) == 1
    assert "out of reach" in capsys.readouterr().err
    assert main(["adapt", str(folder / "run"), "--speed", "1.25", *robot]) == 0
    assert "0.200 rad, at 1.25 times the shown speed" in capsys.readouterr().out
    assert read_places(folder / "run" / "places")[-1].speed == 1.25
    assert main(["adapt", str(folder / "run"), *robot]) == 1
    assert "give --object-pose, --speed or both" in capsys.readouterr().err


def test_poses_on_the_wire_and_in_a_bag(begun):
    np.testing.assert_allclose(decode_pose(encode_pose(OBJECT)), OBJECT, atol=1e-12)
    told = recorded_object_pose(begun / "run" / "demonstration")
    np.testing.assert_allclose(told, OBJECT, atol=1e-9)
    assert recorded_object_pose(begun / "run" / "trials" / "000") is None
    with pytest.raises(BagError, match="no pose"):
        decode_pose(encode_pose(pose((np.nan, 0.0, 0.0))))
    with pytest.raises(BagError, match="are no geometry_msgs"):
        decode_pose(b"short")


def test_an_object_turns_about_itself():
    moved = shifted(OBJECT, 0.1, -0.2, 0.3)
    np.testing.assert_allclose(moved[:3, 3], OBJECT[:3, 3] + [0.1, -0.2, 0.0])
    np.testing.assert_allclose(displacement(OBJECT, moved), (0.1, -0.2, 0.3), atol=1e-12)


def test_the_horizon_is_the_demonstrations(folder):
    run = opened(folder)
    adapter(folder).adapt(run, moved_to(PLACE))
    assert run.task.horizon == HORIZON
    run.close()
