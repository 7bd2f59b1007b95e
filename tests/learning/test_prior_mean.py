"""Linear prior means."""

import numpy as np
import pytest

from irlpilco_ros.learning.errors import InvalidSettingError
from irlpilco_ros.learning.gp.prior_mean import velocity_prior, zero_prior


def test_a_joint_integrates_its_command():
    prior = velocity_prior(2, 0.5)
    assert prior.shape == (4, 6)
    state, control = np.array([0.1, 0.2, 0.3, -0.4]), np.array([1.0, 2.0])
    change = prior @ np.concatenate([state, control])
    np.testing.assert_allclose(change, [0.5, 1.0, 1.0 - 0.3, 2.0 + 0.4])


def test_zero():
    np.testing.assert_array_equal(zero_prior(2, 1), np.zeros((2, 3)))


@pytest.mark.parametrize(("joints", "dt"), [(0, 0.5), (2, 0.0), (2, -1.0), (2, np.nan)])
def test_refusals(joints, dt):
    with pytest.raises(InvalidSettingError, match="velocity prior"):
        velocity_prior(joints, dt)
