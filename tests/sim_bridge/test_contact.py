"""Two arms that are driven into each other stop, by commands that move nothing or by efforts."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from irlpilco_ros.control.controller_settings import ControllerSettings
from irlpilco_ros.control.motion_control import MotionControl, Outcome
from irlpilco_ros.control.motions import Trial
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.episode import as_message
from sim_bridge.joints import ARM_JOINTS
from sim_bridge.motion_files import load_motion
from sim_bridge.simulation_settings import SimulationSettings

INWARDS = {"left_s0": -0.4, "right_s0": 0.4}  # [rad/s]


class Inwards:
    """Closes the arms like a pair of scissors, gently, and holds all other joints."""

    def __init__(self, start: np.ndarray) -> None:
        self.start = start

    def act(self, state: np.ndarray, step: int) -> np.ndarray:
        hold = (5.0 * (self.start - state[:14])).clip(-1.0, 1.0)
        share = min(1.0, step / 20)
        speeds = [share * INWARDS.get(joint, np.nan) for joint in ARM_JOINTS]
        return np.where(np.isnan(speeds), hold, speeds)


def drive_together(preset: str, effort_limit: tuple[float, ...] = ()) -> tuple[float, float, str]:
    """Return when the arms met, when the robot was stopped [s], and why."""
    robot = BaxterSimulation(SimulationSettings(preset=preset))
    motion = load_motion()
    hands = dict(zip(motion.joints, motion.at(0.0)[0], strict=True))
    raised = dict.fromkeys(("left_s1", "right_s1"), -0.9)  # above the table
    robot.reset(positions=[{**hands, **raised}[joint] for joint in ARM_JOINTS])
    settings = dataclasses.replace(robot.robot_settings, effort_limit=effort_limit)
    control = MotionControl(settings, ControllerSettings())
    outcomes: list[Outcome] = []
    control.take(as_message(robot.read()), 0.0)
    control.start(Trial(Inwards(robot.true_positions), 1000, 0.05), 0.0, outcomes.append)
    met = np.inf
    for _ in range(2000):
        command = control.take(as_message(robot.read()), 0.0)
        assert command is not None
        if outcomes:
            return met, robot.time, outcomes[0].message
        robot.command(ARM_JOINTS, command.values)
        robot.step()
        if robot.data.ncon and arms_touch(robot):
            met = min(met, robot.time)
    raise AssertionError("the arms push for ever")


def arms_touch(robot: BaxterSimulation) -> bool:
    for contact in robot.data.contact[: robot.data.ncon]:
        names = {
            robot.model.body(robot.model.geom_bodyid[geom]).name.split("_")[0]
            for geom in (contact.geom1, contact.geom2)
        }
        if names == {"left", "right"}:
            return True
    return False


@pytest.mark.parametrize("preset", ["stiff", "compliant", "delayed"])
def test_arms_that_push_each_other_stop(preset: str) -> None:
    met, stopped, reason = drive_together(preset)
    assert "is commanded but does not move" in reason
    assert 0.0 < stopped - met < 3.0


def test_an_effort_limit_stops_them_sooner() -> None:
    met, stopped, reason = drive_together("compliant", effort_limit=(8.0,) * 14)
    assert "its effort limit is 8 Nm" in reason
    assert 0.0 < stopped - met < 1.0
