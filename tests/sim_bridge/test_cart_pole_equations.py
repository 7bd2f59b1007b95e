"""The equations of motion against the original PILCO software, energy, and MuJoCo."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from sim_bridge.cart_pole_equations import (
    CART_POLE_MODEL,
    CartPoleParameters,
    accelerations,
    energy,
    integrate,
    tip_distance,
)

GOLDEN = np.load(Path(__file__).parents[1] / "golden" / "cpsim.npz")
PARAMETERS = CartPoleParameters()
CASES = sorted({key.split("/")[0] for key in GOLDEN})


def transitions():
    """Yield state, force, its derivative and the state after 0.1 s, in this package's order."""
    order = [0, 3, 1, 2]  # the original has [x, x_dot, theta_dot, theta]
    for case in CASES:
        arrays = (GOLDEN[f"{case}/{name}"] for name in ("in/z", "in/u", "out/dz", "out/znext"))
        for z, u, dz, following in zip(*arrays, strict=True):
            yield z[order], float(u[0]), dz[order], following[order]


def test_accelerations_are_those_of_the_original():
    for state, force, derivative, _ in transitions():
        found = accelerations(state[1], state[2], state[3], force, PARAMETERS)
        np.testing.assert_allclose(found, derivative[2:], rtol=1e-12, atol=1e-12)


def test_integration_is_exact_to_eight_digits():
    for state, force, _, following in transitions():
        np.testing.assert_allclose(integrate(state, force, 0.1, PARAMETERS), following, atol=1e-8)


def test_energy_is_kept_without_friction_and_force():
    free = CartPoleParameters(friction=0.0)
    state = np.array([0.0, 2.0, 0.3, 1.0])
    after = integrate(state, 0.0, 10.0, free)
    assert energy(after, free) == pytest.approx(energy(state, free), abs=1e-8)
    assert np.abs(after - state).max() > 0.1
    assert energy(integrate(state, 0.0, 10.0, PARAMETERS), PARAMETERS) < energy(state, free)


def test_the_tip_is_at_its_goal_when_upright_over_the_origin():
    states = np.array([[0.0, np.pi, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0], [0.1, np.pi, 0.0, 0.0]])
    np.testing.assert_allclose(tip_distance(states, PARAMETERS), [0.0, 1.0, 0.1], atol=1e-12)


def test_the_mjcf_model_is_the_same_system():
    model = mujoco.MjModel.from_xml_path(str(CART_POLE_MODEL))
    data = mujoco.MjData(model)
    for state, force, _, following in transitions():
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:], data.ctrl[:] = state[:2], state[2:], force
        for _ in range(100):
            mujoco.mj_step(model, data)
        np.testing.assert_allclose(np.append(data.qpos, data.qvel), following, atol=1e-6)
    mujoco.mj_forward(model, data)
    tip = data.site("tip").xpos
    expected = data.qpos[0] + 0.5 * np.sin(data.qpos[1]), -0.5 * np.cos(data.qpos[1])
    np.testing.assert_allclose(tip[[0, 2]], expected, atol=1e-12)
