"""Paths carried over: the tools go their ways as shown, and the joints stay near what was shown."""

from __future__ import annotations

import numpy as np
import pytest
from planar_arm import planar

from irlpilco_ros.experience.parameters_file import load_parameters_file, settings_from_parameters
from irlpilco_ros.experience.robot_settings import RobotSettings
from irlpilco_ros.kinematics.carried_path import Carrier
from irlpilco_ros.kinematics.description_file import kinematics_of
from irlpilco_ros.kinematics.errors import UnreachableError
from irlpilco_ros.kinematics.inverse import REACHED, solve
from irlpilco_ros.kinematics.rigid_motion import difference, inverse, pose
from irlpilco_ros.kinematics.tools import ToolSettings
from irlpilco_ros.resources import config_file
from sim_bridge.motion_files import BY_HAND, load_motion

OBJECT = (0.645, -0.15, -0.12)
"""Where the pile lies that is swept [m]."""

TIMES = np.arange(0.0, 8.0, 0.04)


@pytest.fixture(scope="module")
def baxter() -> Carrier:
    values = load_parameters_file(config_file("baxter.yaml"), "learner")
    robot = settings_from_parameters(RobotSettings, values)
    tools = settings_from_parameters(ToolSettings, values)
    return Carrier(kinematics_of(tools, robot.joints), robot.lower, robot.upper)


@pytest.fixture(scope="module")
def sweep() -> np.ndarray:
    motion = load_motion(BY_HAND)
    return np.stack([motion.at(time)[0] for time in TIMES])


def move_by(x: float, y: float, turn: float, up: float = 0.0) -> np.ndarray:
    """Return the object's motion: so far, and turned by so much about its own vertical."""
    now = pose(np.add(OBJECT, (x, y, up)), (0.0, 0.0, turn))
    return now @ inverse(pose(OBJECT))


@pytest.mark.parametrize("place", [(0.07, 0.05, -0.3), (-0.08, -0.06, 0.2)])
def test_the_tools_are_where_they_were_shown_as_the_object_sees_them(baxter, sweep, place):
    move = move_by(*place)
    carried = baxter.carry(TIMES, sweep, move)
    for shown, now in zip(sweep, carried, strict=True):
        wanted = move @ baxter.kinematics.poses(shown)
        assert np.abs(difference(wanted, baxter.kinematics.poses(now))).max() <= REACHED
    # It goes as smoothly as what was shown, and from there to here.
    shown_speed = np.abs(np.diff(sweep, axis=0)).max()
    assert np.abs(np.diff(carried, axis=0)).max() < 2.0 * shown_speed
    bend, shown_bend = (np.abs(np.diff(each, 2, axis=0)).max() for each in (carried, sweep))
    assert bend < 3.0 * shown_bend
    assert (carried >= baxter.lower).all()
    assert (carried <= baxter.upper).all()


def test_an_object_that_stays_leaves_the_path_as_it_was(baxter, sweep):
    np.testing.assert_allclose(baxter.carry(TIMES, sweep, np.eye(4)), sweep, atol=1e-9)


def test_what_the_tools_leave_free_stays_nearest_to_what_was_shown(baxter, sweep):
    shown, poses = sweep[50], move_by(0.03, -0.02, 0.1) @ baxter.kinematics.poses(sweep[50])
    solution = solve(baxter.kinematics, poses, shown, shown, baxter.lower, baxter.upper)
    assert solution.reached
    _, jacobians = baxter.kinematics.poses_and_jacobians(solution.positions)
    unfelt = np.linalg.svd(jacobians.reshape(-1, 14))[2][12:]
    away = solution.positions - shown
    assert np.linalg.norm(away) > 0.05
    np.testing.assert_allclose(unfelt @ away, 0.0, atol=1e-5)


OUT_OF_REACH = [
    (0.6, 0.0, 0.0),
    (0.0, -1.2, 0.0),
    (-0.6, 0.0, 0.0),
    (0.0, 0.9, 0.0),
    (0.5, 0.5, 0.3),
    (0.45, 0.0, 0.0),
    (0.0, 0.0, 2.5),
    (0.3, -0.6, -1.0),
    (0.0, 0.0, 0.0, 1.2),
    (0.0, 0.0, 0.0, -0.9),
]


@pytest.mark.parametrize("place", OUT_OF_REACH, ids=str)
def test_places_out_of_reach_are_refused_with_tool_or_joint_time_and_distance(baxter, sweep, place):
    with pytest.raises(UnreachableError) as refusal:
        baxter.carry(TIMES, sweep, move_by(*place))
    message = str(refusal.value)
    assert "s after the motion's start" in message
    if "out of reach" in message:
        assert message.startswith(("dustpan_lip", "brush_tip"))
        assert "no nearer than" in message
    else:
        assert "would have to go to" in message
        assert message.startswith(baxter.kinematics.joints)


def test_a_joint_at_its_limit_stays_there_and_the_others_do_the_rest():
    """A pen that may turn freely would need one joint less; here all three are needed."""
    kinematics, none = planar(), np.full(3, 9.0)
    wanted = np.array([0.4, 0.5, 0.3])
    poses = kinematics.poses(np.array([0.8, 0.5, 0.3]))
    free = solve(kinematics, poses, wanted, wanted, -none, none)
    assert free.reached
    held = solve(kinematics, poses, wanted, wanted, -none, np.array([0.6, 9.0, 9.0]))
    assert held.at_limit.tolist() == [True, False, False]
    assert held.positions[0] == 0.6
    assert not held.reached


def test_a_path_that_only_a_joints_limit_forbids_names_the_joint():
    kinematics = planar()
    upper = np.array([0.9, 2.5, 2.5])
    carrier = Carrier(kinematics, np.full(3, -2.5), upper)
    times = np.linspace(0.0, 1.0, 11)
    shown = np.stack([0.2 + 0.3 * times, 0.9 + 0.0 * times, 0.3 + 0.0 * times], axis=1)
    turned = pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.5))  # about the arm's own first joint
    message = r"joint0 would have to go to 1\.000 rad, 1\.00 s .* \[-2\.5, 0\.9\]"
    with pytest.raises(UnreachableError, match=message):
        carrier.carry(times, shown, turned)
    np.testing.assert_allclose(
        Carrier(kinematics, np.full(3, -2.5), np.full(3, 2.5)).carry(times, shown, turned),
        np.add(shown, (0.5, 0.0, 0.0)),
        atol=1e-8,
    )


def test_a_place_at_which_an_arm_passes_a_singular_posture_is_reached(baxter, sweep):
    move = move_by(-0.04, -0.06, 0.3)
    carried = baxter.carry(TIMES, sweep, move)
    missing = [
        np.abs(difference(move @ baxter.kinematics.poses(a), baxter.kinematics.poses(b))).max()
        for a, b in zip(sweep, carried, strict=True)
    ]
    assert max(missing) <= REACHED
