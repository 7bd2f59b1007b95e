"""The commands over damaged bags: no traceback, no half-made result, nothing overwritten."""

from __future__ import annotations

import random
import shutil
from collections import Counter

import pytest
import toy_robot
from damaged_bags import contents, damage

from irlpilco_ros.cli import main
from irlpilco_ros.experience.apprenticeship import Apprenticeship
from irlpilco_ros.learning.learning_settings import LearningSettings

SETTINGS = LearningSettings(evaluations=1, options={"linear_phase.count": 3})
SETTINGS_FILE = "/**:\n  ros__parameters:\n    evaluations: 1\n    linear_phase.count: 3\n"


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """A demonstration, a trial, and files of settings."""
    path = tmp_path_factory.mktemp("sound")
    bag = toy_robot.record_demonstration(path / "shown")
    run = Apprenticeship.open(path / "run", bag, toy_robot.ROBOT, SETTINGS)
    toy_robot.record_trial(run.prepare(), path / "trials")
    run.close()
    (path / "robot.yaml").write_text(toy_robot.ROBOT_FILE)
    (path / "settings.yaml").write_text(SETTINGS_FILE)
    return path


def words_of(command, work, bag):
    if command == "recover":
        return ["recover", str(bag)]
    robot = ["--robot", str(work / "robot.yaml")]
    if command == "inspect":
        return ["inspect", str(bag), *robot]
    folders = {"--trials": "trials", "--settings": "settings.yaml", "--run-directory": "out"}
    words = [word for option, name in folders.items() for word in (option, str(work / name))]
    return ["train", "--demonstration", str(work / "shown" / "000"), *robot, *words]


@pytest.mark.parametrize("damaged", ["shown", "trials"])
@pytest.mark.parametrize("command", ["inspect", "recover", "train"])
def test_a_command_ends_with_a_result_or_a_sentence(sound, tmp_path, capsys, damaged, command):
    rng = random.Random(f"11 {command} {damaged}")
    codes: Counter[int] = Counter()
    for number in range(50):
        work = shutil.copytree(sound, tmp_path / str(number))
        bag = work / damaged / "000"
        damage(bag, rng)
        before = contents(work)
        code = main(words_of(command, work, bag))
        codes[code] += 1
        error = capsys.readouterr().err
        assert "Traceback" not in error
        assert code == 0 or error.splitlines()[-1].startswith("irlpilco: ")
        after = contents(work)
        assert {path: after[path] for path in before} == before
        assert (work / "out").exists() == (command == "train" and code == 0)
        shutil.rmtree(work)
    assert codes[0]
    assert set(codes) <= {0, 1}
