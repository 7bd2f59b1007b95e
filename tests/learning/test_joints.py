import numpy as np
import pytest

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.features import JointPositions
from irlpilco_ros.learning.joints import Joints, PolicyOf
from irlpilco_ros.learning.policies import LinearPolicy

CART_POLE = Joints(("cart", "pole"), unactuated=("pole",), continuous=("pole",))


def test_mere_names_are_commanded_and_seen_as_they_are():
    joints = Joints(("a", "b"))
    assert joints == Joints(("a", "b"))
    assert joints.commanded == ("a", "b")
    assert JointPositions.of_robot(joints) == JointPositions(2)
    state = np.arange(4.0)
    np.testing.assert_array_equal(joints.layout.policy_view(state), state)


def test_a_cart_pole_is_seen_as_pilco_sees_it():
    state = np.array([0.3, 2.0, -0.1, 0.7])  # x, theta, x_dot, theta_dot
    seen = [0.3, -0.1, 0.7, np.sin(2.0), np.cos(2.0)]
    np.testing.assert_allclose(CART_POLE.layout.policy_view(state), seen)
    np.testing.assert_allclose(CART_POLE.layout.dynamics_view(state), seen)
    features = JointPositions.of_robot(CART_POLE)
    np.testing.assert_allclose(features.of(state), [0.3, np.sin(2.0), np.cos(2.0)])
    assert CART_POLE.policy_size == 5
    assert (CART_POLE.commanded, CART_POLE.commanded_columns) == (("cart",), [0])


def test_a_policy_acts_on_the_whole_state():
    policy = LinearPolicy(np.array([[0.0, 0.0, 0.0, 1.0, 0.0]]), np.zeros(1), np.array([1.0]))
    turn = np.array([0.0, 1.0, 0.0, 0.0])
    moved = PolicyOf(CART_POLE, policy).act(turn, 0)
    np.testing.assert_array_equal(moved, policy.act(CART_POLE.layout.policy_view(turn), 0))
    whole_turn = turn + np.array([0.0, 2.0 * np.pi, 0.0, 0.0])
    np.testing.assert_allclose(PolicyOf(CART_POLE, policy).act(whole_turn, 0), moved)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"names": ("a", "a")}, "names a joint twice: a, a"),
        ({"names": ("a",), "continuous": ("b",)}, "continuous joints b are not among .* a"),
        ({"names": ("a", "b"), "unactuated": ("b", "a")}, "all of the joints a, b are unactuated"),
    ],
)
def test_nonsense_is_refused(arguments, message):
    with pytest.raises(InvalidSettingError, match=message):
        Joints(**arguments)
