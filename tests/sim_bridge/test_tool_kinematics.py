import numpy as np

from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.tool_kinematics import TOOL_POINTS, ToolKinematics


def test_points_are_those_of_the_simulation():
    simulation = BaxterSimulation()
    places, _ = ToolKinematics()(simulation.true_positions[None])
    expected = np.concatenate([simulation.data.site(name).xpos for name in TOOL_POINTS])
    np.testing.assert_allclose(places[0], expected, atol=1e-12)


def test_jacobian_against_finite_differences():
    kinematics = ToolKinematics()
    point = 0.4 * np.random.default_rng(0).standard_normal(14)
    _, jacobians = kinematics(point[None])
    step = 1e-6
    ahead, _ = kinematics(point + step * np.eye(14))
    behind, _ = kinematics(point - step * np.eye(14))
    np.testing.assert_allclose(jacobians[0], (ahead - behind).T / (2.0 * step), atol=1e-8)
    assert not jacobians[0, :3, 7:].any()
    assert not jacobians[0, 3:, :7].any()
