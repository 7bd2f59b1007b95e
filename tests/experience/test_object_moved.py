"""Whether an object has moved is told as well as who sees it can tell."""

from __future__ import annotations

import numpy as np
import pytest

from irlpilco_ros.experience.errors import ObjectMovedError
from irlpilco_ros.experience.object_moved import check_stayed
from irlpilco_ros.experience.object_pose import shifted
from irlpilco_ros.kinematics.rigid_motion import pose

OBJECT = pose((0.6, -0.1, -0.1), (0.0, 0.0, 0.4))


def readings(place, way=0.002, turn=0.01, count=20, seed=0):
    """What a camera with this noise tells of an object that was moved, and turned."""
    rng, where = np.random.default_rng(seed), shifted(OBJECT, *place)
    off = np.hstack([way * rng.standard_normal((count, 3)), turn * rng.standard_normal((count, 3))])
    return np.stack([where @ pose(each[:3], each[3:]) for each in off])


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("count", [1, 3, 20])
def test_noise_is_no_motion(seed, count):
    check_stayed([OBJECT], readings((0.0, 0.0, 0.0), seed=seed, count=count))


@pytest.mark.parametrize("place", [(0.02, 0.0, 0.0), (0.0, -0.015, 0.0), (0.0, 0.0, 0.08)])
@pytest.mark.parametrize("seed", range(5))
def test_a_motion_is_noticed_through_the_noise(place, seed):
    with pytest.raises(ObjectMovedError, match="call learner/adapt"):
        check_stayed([OBJECT], readings(place, seed=seed))


def test_it_says_how_far():
    moved = readings((0.03, -0.04, -0.2), 0.0, 0.0)
    with pytest.raises(ObjectMovedError, match=r"moved by 0\.050 m and 0\.200 rad since"):
        check_stayed([OBJECT], moved)


def test_a_bad_camera_is_believed_less():
    moved = (0.015, 0.0, 0.0)
    check_stayed([OBJECT], readings(moved, way=0.015, count=20))
    with pytest.raises(ObjectMovedError):
        check_stayed([OBJECT], readings(moved, way=0.015, count=2000))


def test_of_several_demonstrations_any_will_do():
    other = shifted(OBJECT, 0.1, 0.0, 0.0)
    check_stayed([other, OBJECT], readings((0.0, 0.0, 0.0)))
    with pytest.raises(ObjectMovedError, match=r"0\.050 m and 0\.000 rad"):
        check_stayed([other, OBJECT], readings((0.05, 0.0, 0.0), 0.0, 0.0))
