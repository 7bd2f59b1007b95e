"""Something in the way of the arms: a trial that is watched stops, one without is left alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from irlpilco_ros.control.band_guard import BandGuard
from irlpilco_ros.control.motions import MotionStoppedError
from irlpilco_ros.experience.parameters_file import load_parameters_file
from irlpilco_ros.experience.policy_file import read_policy_file
from irlpilco_ros.experience.predicted_band import PredictedBand
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.joints import PolicyOf
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.episode import run_trial
from sim_bridge.simulation_settings import SimulationSettings

POLICY = Path(__file__).parents[2] / "bags" / "sweep" / "policy_001.yaml"
IN_THE_WAY = (0.64, -0.12, -0.06)
"""Where the brush comes by in the first stroke, after 1.6 s [m]."""


class Watched:
    """A trial of the shipped policy on a robot, guarded by its own prediction."""

    def __init__(self, **settings) -> None:
        self.robot = BaxterSimulation(SimulationSettings(**settings))
        self.policy, self.joints = read_policy_file(POLICY)
        self.told = load_parameters_file(POLICY, "controller")
        self.robot.reset(positions=np.array(self.told["start_position"]))
        self.touched = np.inf

    def run(self, sigma: float) -> None:
        band = PredictedBand.from_parameters(self.told, self.joints)
        assert band is not None
        run_trial(
            self.robot,
            PolicyOf(self.joints, self.policy),
            self.told["trial_horizon"],
            self.told["trial_control_period"],
            self.look,
            BandGuard(self.joints, band, sigma),
        )

    def look(self) -> None:
        """Note when anything first touches the obstacle."""
        for contact in self.robot.data.contact[: self.robot.data.ncon]:
            names = (self.robot.model.geom(geom).name for geom in (contact.geom1, contact.geom2))
            if "obstacle" in names:
                self.touched = min(self.touched, self.robot.time)


def test_an_obstacle_stops_the_trial_within_two_control_periods() -> None:
    trial = Watched(obstacle=IN_THE_WAY)
    with pytest.raises(MotionStoppedError, match=r"joint right_\w+ is .* is something in its way"):
        trial.run(sigma=6.0)
    assert 1.0 < trial.touched < 2.0
    assert trial.robot.time - trial.touched <= 2.0 * trial.told["trial_control_period"]


@pytest.mark.parametrize("seed", range(3))
def test_ordinary_trials_are_left_alone(seed: int) -> None:
    trial = Watched(seed=seed)
    trial.run(sigma=6.0)
    assert trial.touched == np.inf


def test_an_obstacle_has_a_place() -> None:
    with pytest.raises(InvalidSettingError, match=r"obstacle has 2 values; expected 3"):
        SimulationSettings(obstacle=(0.1, 0.2))
