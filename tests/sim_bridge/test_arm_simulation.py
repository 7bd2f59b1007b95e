from typing import Any

import numpy as np
import pytest

from sim_bridge.arm_simulation import ArmSettings, ArmSimulation
from sim_bridge.errors import InvalidCommandError
from sim_bridge.motion_files import WIPE, load_motion

HOME = [0.0, 0.0, 0.0, -np.pi / 2, 0.0, np.pi / 2, -np.pi / 4]
QUIET: dict[str, Any] = {"position_noise": 0.0, "velocity_noise": 0.0}


def test_the_flange_is_where_the_maker_says():
    arm = ArmSimulation()
    arm.place(HOME)
    np.testing.assert_allclose(arm.data.body("sponge").xpos, [0.5545, 0.0, 0.6245], atol=1e-9)


def test_joints_integrate_their_commands_after_the_lag_at_their_own_speed():
    arm = ArmSimulation(settings=ArmSettings(speed_factor=(0.5,), command_lag=0.1, **QUIET))
    arm.place(HOME)
    for _ in range(60):
        arm.command(arm.joint_names, np.full(7, 0.2))
        arm.step()
    moved = arm.read().positions - HOME
    expected = 0.5 * 0.2 * (0.6 - 0.1)
    assert (moved < expected).all()
    assert (moved > 0.8 * expected).all(), "it only has to pick up speed"
    assert arm.read().stamp == 600_000_000


def test_the_wipe_stays_just_above_the_table():
    arm = ArmSimulation()
    motion = load_motion(WIPE)
    assert motion.joints == arm.joint_names
    for time in np.linspace(0.0, motion.duration, 100):
        arm.place(motion.at(time)[0])
        assert 0.005 < arm.data.site("sponge").xpos[2] < 0.03
        assert arm.data.ncon == 0


def test_what_is_shown_is_the_motion_with_noise():
    arm, motion = ArmSimulation(), load_motion(WIPE)
    states = arm.show(motion, 0.5)
    assert states.shape == (17, 14)
    deviation = states[:, :7] - [motion.at(0.5 * k)[0] for k in range(17)]
    assert 2e-4 < deviation.std() < 6e-4


@pytest.mark.parametrize(
    ("names", "values"),
    [(("panda_joint1",), [0.1]), (None, [0.1]), (None, [np.nan] * 7)],
)
def test_wrong_commands_are_refused(names, values):
    arm = ArmSimulation()
    with pytest.raises(InvalidCommandError):
        arm.command(arm.joint_names if names is None else names, values)
