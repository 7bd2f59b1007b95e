"""Names of before: read in files, and told of once."""

from __future__ import annotations

import logging

import pytest

from irlpilco_ros.experience import renamed
from irlpilco_ros.experience.configuration import differing_keys
from irlpilco_ros.experience.parameters_file import load_parameters_file
from irlpilco_ros.learning.learning_settings import LearningSettings
from irlpilco_ros.learning.settings import declarations

OLD = """\
/**:
  ros__parameters:
    race: 2
    stages: 3
    phase_count: 5
    seed: 1
    policy: {velocity_limit: [1.0]}
"""


@pytest.fixture(autouse=True)
def fresh(monkeypatch):
    monkeypatch.setattr(renamed, "_told", set())


def test_a_file_of_before_is_read_under_the_new_names_with_one_warning_each(tmp_path, caplog):
    path = tmp_path / "old.yaml"
    path.write_text(OLD)
    with caplog.at_level(logging.WARNING):
        values = load_parameters_file(path, "learner")
        load_parameters_file(path, "learner")
    assert values == {
        "screening_evaluations": 2,
        "horizon_stages": 3,
        "linear_phase.count": 5,
        "seed": 1,
        "policy.control_limit": [1.0],
    }
    told = [record.getMessage() for record in caplog.records]
    assert len(told) == 4
    assert any("phase_count is called linear_phase.count now" in line for line in told)
    assert all(str(path) in line for line in told)


def test_the_new_name_counts_where_both_are_given():
    assert renamed.under_new_names({"race": 2, "screening_evaluations": 7}) == {
        "screening_evaluations": 7
    }
    assert renamed.under_new_names({"screening_evaluations": 7, "race": 2}) == {
        "screening_evaluations": 7
    }


def test_every_new_name_of_learning_is_one_that_there_is():
    known = {*declarations(LearningSettings), "unactuated_joints", "continuous_joints"}
    new = {name for name in renamed.RENAMED.values() if not name.startswith("policy.")}
    assert new <= known


def test_a_configuration_of_before_is_compared_by_the_new_names():
    now = {"horizon_stages": 3, "linear_phase.count": 16, "rbf.count": 10}
    assert differing_keys({"stages": 3, "phase_count": 16, "rbf_count": 10}, now) == []
    assert differing_keys({"stages": 3, "phase_count": 8, "rbf_count": 10}, now) == [
        "linear_phase.count was 8, now 16"
    ]


def test_settings_of_extensions_come_and_go_with_what_is_installed():
    assert differing_keys({"seed": 0, "gone.gain": 2.0}, {"seed": 0}) == []
    assert differing_keys({"seed": 0}, {"seed": 0, "rbf.count": 10}) == []
    assert differing_keys({"seed": 0}, {"seed": 0, "rbf.count": 11}) == ["rbf.count was 10, now 11"]


def test_what_is_only_said_otherwise_is_the_same_run():
    assert differing_keys({"seed": 0}, {"seed": 0, "sliding_joints": ["lift"]}) == []
