"""Features of tools: their moments, their gradients, and what does not change with the place."""

from __future__ import annotations

import numpy as np
import pytest
from planar_arm import planar, planar_hand

from irlpilco_ros.kinematics.rigid_motion import pose
from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.features import REGISTRY, ComparedTools
from irlpilco_ros.learning.joints import Joints
from irlpilco_ros.learning.moments.gaussian import Gaussian
from irlpilco_ros.learning.registry import NoSettings

JOINTS = Joints(("joint0", "joint1", "joint2"))
SIZE, PRICE = 0.2, 0.05
MOVE = pose((0.1, -0.2, 0.05), (0.0, 0.0, 0.4))


def tool_points(size=SIZE, price=PRICE):
    tools = ComparedTools(planar(), size, price)
    return REGISTRY.get("tools").of_tools(JOINTS, NoSettings(), lambda: tools)


def state(scale=1.0) -> Gaussian:
    rng = np.random.default_rng(1)
    root = 0.08 * scale * rng.standard_normal((6, 6))
    return Gaussian(np.array([0.3, -0.6, 0.8, 0.1, 0.0, -0.2]), root @ root.T)


def test_three_points_tell_where_the_tool_is_and_how_it_is_turned():
    positions = np.array([0.3, -0.6, 0.8])
    features = tool_points().of(np.concatenate([positions, np.zeros(3)]))
    x, y, direction = planar_hand(positions)
    first, second, third = features[:9].reshape(3, 3)
    np.testing.assert_allclose(first, [x, y, 0.0], atol=1e-12)
    along = [np.cos(direction), np.sin(direction), 0.0]
    across = [-np.sin(direction), np.cos(direction), 0.0]
    np.testing.assert_allclose(second, first + SIZE * np.array(along), atol=1e-12)
    np.testing.assert_allclose(third, first + SIZE * np.array(across), atol=1e-12)
    np.testing.assert_allclose(features[9:], PRICE * positions)
    assert tool_points().units == ("m",) * 12
    # Without a size the place alone counts, and without a price the posture does not.
    alone = tool_points(0.0, 0.0)
    assert alone.units == ("m",) * 3
    np.testing.assert_allclose(alone.of(np.concatenate([positions, np.zeros(3)])), first)


def test_where_the_object_has_moved_what_it_sees_is_the_same():
    moved = tool_points().where_moved(MOVE)
    rng = np.random.default_rng(2)
    states = rng.uniform(-1.0, 1.0, (5, 6))
    seen, here = moved.of(states), tool_points().of(states)
    points = here[:, :9].reshape(5, 3, 3)
    carried = (points - MOVE[:3, 3]) @ MOVE[:3, :3]
    np.testing.assert_allclose(seen[:, :9], carried.reshape(5, 9), atol=1e-12)
    np.testing.assert_array_equal(seen[:, 9:], here[:, 9:])
    # Features of joints see no object.
    joints = REGISTRY.get("joints").of_robot(JOINTS, NoSettings())
    assert joints.where_moved(MOVE) is joints


@pytest.mark.parametrize("features", [tool_points(), tool_points().where_moved(MOVE)])
def test_moments_are_those_of_samples(features):
    given = state()
    moments, _ = features.moments(given)
    samples = np.random.default_rng(3).multivariate_normal(given.mean, given.covariance, 20_000)
    found = features.of(samples)
    spread = found.std(axis=0)
    np.testing.assert_allclose(moments.mean, found.mean(axis=0), atol=0.05 * spread.max())
    np.testing.assert_allclose(moments.covariance, np.cov(found.T), atol=0.12 * spread.max() ** 2)
    assert moments.jacobian.shape == (12, 6)
    np.testing.assert_array_equal(moments.jacobian[:, 3:], 0.0)


def test_the_jacobian_is_the_slope():
    features, at, step = tool_points().where_moved(MOVE), state(1e-6), 1e-6
    moments, _ = features.moments(at)
    for joint in range(3):
        off = step * np.eye(6)[joint]
        slope = (features.of(at.mean + off) - features.of(at.mean - off)) / (2.0 * step)
        np.testing.assert_allclose(moments.jacobian[:, joint], slope, atol=1e-8)


def test_the_gradient_is_that_of_finite_differences():
    features, given, step = tool_points().where_moved(MOVE), state(), 1e-6
    rng = np.random.default_rng(4)
    mean_bar, root = rng.standard_normal(12), rng.standard_normal((12, 12))
    covariance_bar = root + root.T

    def value(mean, covariance):
        found, _ = features.moments(Gaussian(mean, covariance))
        return float(mean_bar @ found.mean + np.sum(covariance_bar * found.covariance))

    _, pull = features.moments(given)
    by_mean, by_covariance = pull(mean_bar, covariance_bar)
    for i in range(3):
        off = step * np.eye(6)[i]
        slope = value(given.mean + off, given.covariance) - value(
            given.mean - off, given.covariance
        )
        assert by_mean[i] == pytest.approx(slope / (2.0 * step), rel=1e-5, abs=1e-7)
        for j in range(i + 1):
            change = np.zeros((6, 6))
            change[i, j] = change[j, i] = step
            slope = value(given.mean, given.covariance + change) - value(
                given.mean, given.covariance - change
            )
            wanted = np.sum(by_covariance * change) / step
            assert wanted == pytest.approx(slope / (2.0 * step), rel=1e-4, abs=1e-6)
    np.testing.assert_array_equal(by_mean[3:], 0.0)


def test_joints_that_turn_without_end_have_no_posture():
    turning = Joints(JOINTS.names, (), ("joint2",))
    with pytest.raises(InvalidSettingError, match="joint2 turn without end; set features: joints"):
        REGISTRY.get("tools").of_tools(
            turning, NoSettings(), lambda: ComparedTools(planar(), SIZE, PRICE)
        )
