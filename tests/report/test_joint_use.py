"""What a trial used of each joint's limits."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import yaml
from report_runs import LATE, demonstrated, write_run

from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.report.joint_use import Movement, joint_uses
from irlpilco_ros.report.read_run import read_run

JOINTS = Joints(("cart", "pole"), ("pole",), ("pole",))
LIMITS = {
    "position_lower": [-1.0, -4.0],
    "position_upper": [2.0, 4.0],
    "velocity_limit": [2.0, 20.0],
    "effort_limit": [10.0, 0.0],
    "command_interface": "effort",
}
DONE = Movement(np.array([[0.0, 0.0], [0.5, -3.0]]), np.array([[0.5, 4.0], [-1.0, -5.0]]))
SHOWN = Movement(DONE.positions, np.array([[0.25, np.nan], [0.0, np.nan]]))


def test_ranges_speeds_and_commands_are_beside_their_limits() -> None:
    cart, pole = joint_uses(JOINTS, LIMITS, DONE, SHOWN, np.array([[3.0], [-4.0]]))
    assert (cart.reached, cart.limits, cart.room) == ((0.0, 0.5), (-1.0, 2.0), 1.0)
    assert (cart.speed, cart.shown_speed, cart.speed_limit, cart.speed_share) == (
        1.0,
        0.25,
        2.0,
        0.5,
    )
    assert (cart.command, cart.command_limit) == (4.0, 10.0)
    assert (pole.speed, pole.room) == (5.0, 1.0)
    assert math.isnan(pole.shown_speed)
    assert math.isnan(pole.command), "nobody commands it"


@pytest.mark.parametrize("key", ["position_lower", "position_upper", "velocity_limit"])
@pytest.mark.parametrize("value", [None, [1.0], ["a", "b"], 3])
def test_a_run_that_knows_no_limits_has_nothing_to_tell(key: str, value: object) -> None:
    assert joint_uses(JOINTS, {**LIMITS, key: value}, DONE, SHOWN, np.ones((1, 1))) == ()


def test_of_a_run_it_is_the_best_trial_that_counts(tmp_path: Path) -> None:
    names, positions = ("left_s0", "left_w2"), demonstrated(2, 4)
    run = write_run(tmp_path / "run", names, positions)
    limits = {
        "position_lower": [-1.0] * 2,
        "position_upper": [1.0] * 2,
        "velocity_limit": [2.0] * 2,
    }
    run.configuration_file.write_text(yaml.safe_dump({**run.configuration(), **limits}))
    found = read_run(run)
    assert found.best.index == 0
    assert [use.joint for use in found.uses] == list(names)
    np.testing.assert_allclose(found.uses[1].reached[1], positions[:, 1].max() + LATE)
    assert found.uses[0].command == 0.25


def test_the_command_runs_the_best_policy_where_it_was_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = write_run(tmp_path / "run", ("left_s0", "left_w2"), demonstrated(2, 4))
    assert read_run(run).best_command.endswith("run/policy_000.yaml")
    run.best_policy_file.write_text("# as the learner writes it")
    assert read_run(run).best_command.endswith("run/best_policy.yaml")
    monkeypatch.setattr("irlpilco_ros.report.read_run.rows_here", lambda _: [])
    assert read_run(run).best_command.endswith("run/policy_000.yaml"), "the other is for elsewhere"
