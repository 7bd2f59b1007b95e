"""ROS parameter files read without ROS."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from irlpilco_ros.experience.parameters_file import (
    load_parameters_file,
    settings_from_parameters,
)
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.settings import check, setting


@dataclass(frozen=True)
class Settings:
    gain: float = setting(1.0, "A gain.", maximum=5.0)
    count: int = setting(3, "A count.")
    names: tuple[str, ...] = setting((), "Names.")
    limits: tuple[float, ...] = setting((), "Limits.")
    is_on: bool = setting(False, "A switch.")

    def __post_init__(self) -> None:
        check(self)


def test_the_section_of_the_node_wins_and_keys_are_flat(tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_text(
        "controller: {ros__parameters: {gain: 3.0}}\n"
        "learner: {ros__parameters: {gain: 9.0}}\n"
        "/**: {ros__parameters: {gain: 1.0, count: 2, policy: {kind: linear, deep: {x: 1}}}}\n"
        "/**/controller: {ros__parameters: {gain: 2.0, count: 5}}\n"
    )
    assert load_parameters_file(path, "controller") == {
        "gain": 3.0,
        "count": 5,
        "policy.kind": "linear",
        "policy.deep.x": 1,
    }
    assert load_parameters_file(path, "demonstrator")["gain"] == 1.0


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a: [1, 2", "is not valid YAML"),
        ("just words", "is no ROS parameter file"),
        ("controller: {gain: 1.0}", "section 'controller' lacks 'ros__parameters:'"),
    ],
)
def test_what_is_no_parameter_file_is_refused(tmp_path, text, reason):
    path = tmp_path / "bad.yaml"
    path.write_text(text)
    with pytest.raises(InvalidSettingError, match=reason):
        load_parameters_file(path, "controller")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InvalidSettingError, match=r"cannot read .*nowhere\.yaml"):
        load_parameters_file(tmp_path / "nowhere.yaml", "controller")


def test_settings_take_what_is_theirs_and_convert_it():
    parameters = {
        "x.gain": 2,
        "x.names": ["a", "b"],
        "x.limits": [1, 2.5],
        "x.is_on": True,
        "x.other": 1,
        "count": 9,
    }
    settings = settings_from_parameters(Settings, parameters, prefix="x.")
    assert settings == Settings(2.0, 3, ("a", "b"), (1.0, 2.5), True)
    assert type(settings.gain) is float
    assert type(settings.limits[0]) is float


@pytest.mark.parametrize(
    ("parameters", "reason"),
    [
        ({"gain": "fast"}, "Settings.gain is 'fast'"),
        ({"gain": True}, "Settings.gain is True"),
        ({"gain": 6.0}, "expected at most 5"),
        ({"count": 1.5}, "Settings.count is 1.5"),
        ({"names": "left"}, "expected a list"),
        ({"limits": [1.0, "x"]}, "Settings.limits is 'x'"),
        ({"is_on": 1}, "Settings.is_on is 1"),
    ],
)
def test_wrong_types_and_ranges_are_refused_by_name(parameters, reason):
    with pytest.raises(InvalidSettingError, match=reason):
        settings_from_parameters(Settings, parameters)
