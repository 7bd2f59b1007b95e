"""The model against reference kinematics and dynamics, and against what a Baxter has."""

from __future__ import annotations

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

from sim_bridge.baxter_model import SCENE, build_model
from sim_bridge.joints import ARM_JOINTS, PUBLISHED_JOINTS
from sim_bridge.motion_files import load_motion
from sim_bridge.simulation_settings import SimulationSettings

GOLDEN = Path(__file__).resolve().parent.parent / "golden" / "baxter"


class BareRobot:
    """The robot without its tools, as the reference values were computed."""

    def __init__(self) -> None:
        spec = mujoco.MjSpec.from_file(str(SCENE))
        for tool in ("dustpan", "brush"):
            spec.delete(spec.body(tool))
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        joints = [self.model.joint(name) for name in ARM_JOINTS]
        self.qpos = np.array([joint.qposadr[0] for joint in joints])
        self.dof = np.array([joint.dofadr[0] for joint in joints])

    def stand(self, positions: list[float]) -> None:
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[self.qpos] = positions
        mujoco.mj_forward(self.model, self.data)

    def frame(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        is_body = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, name) >= 0
        view = self.data.body(name) if is_body else self.data.site(name)
        return view.xpos, view.xmat.reshape(3, 3)


@pytest.fixture(scope="module")
def bare() -> BareRobot:
    return BareRobot()


def golden(name: str) -> dict:
    values = json.loads((GOLDEN / f"{name}.json").read_text())
    assert tuple(values["meta"]["joint_order"]) == ARM_JOINTS
    return values


def test_forward_kinematics(bare: BareRobot) -> None:
    cases = golden("forward_kinematics")["cases"]
    assert len(cases) == 20
    for case in cases:
        bare.stand(case["q"])
        assert len(case["frames"]) == 6
        for name, expected in case["frames"].items():
            position, rotation = bare.frame(name)
            np.testing.assert_allclose(position, expected["pos"], rtol=0, atol=5e-5)
            np.testing.assert_allclose(rotation, expected["R"], rtol=0, atol=5e-5)


def test_gravity_torques(bare: BareRobot) -> None:
    for case in golden("dynamics")["gravity_cases"]:
        bare.stand(case["q"])
        torque = bare.data.qfrc_bias[bare.dof]
        np.testing.assert_allclose(torque, case["tau_gravity"], rtol=0, atol=0.02)


def test_gravity_compensation_carries_arms_and_tools() -> None:
    model = build_model(SimulationSettings())
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("sweep_start").id)
    mujoco.mj_forward(model, data)
    dof = [model.joint(name).dofadr[0] for name in ARM_JOINTS]
    np.testing.assert_allclose(data.qfrc_gravcomp[dof], data.qfrc_bias[dof], rtol=0, atol=1e-9)
    assert np.abs(data.qfrc_bias[dof]).max() > 5.0


def test_mass_matrices(bare: BareRobot) -> None:
    for case in golden("dynamics")["mass_matrix_cases"]:
        bare.stand(case["q"])
        full = np.zeros((bare.model.nv, bare.model.nv))
        mujoco.mj_fullM(bare.model, bare.data, full)
        # The reference has no motors, whose inertia the model adds on the diagonal.
        arms = (full - np.diag(bare.model.dof_armature))[np.ix_(bare.dof, bare.dof)]
        np.testing.assert_allclose(arms[:7, :7], case["M_left_7x7"], rtol=0, atol=2e-3)
        np.testing.assert_allclose(arms[7:, 7:], case["M_right_7x7"], rtol=0, atol=2e-3)


def test_joints_are_those_of_the_urdf() -> None:
    model = build_model(SimulationSettings())
    assert sorted(model.joint(i).name for i in range(model.njnt)) == list(PUBLISHED_JOINTS)
    assert [model.actuator(i).name for i in range(model.nu)] == list(ARM_JOINTS)
    limits = {
        "s0": (-1.70167993878, 1.70167993878, 1.5, 50.0),
        "s1": (-2.147, 1.047, 1.5, 50.0),
        "e0": (-3.05417993878, 3.05417993878, 1.5, 50.0),
        "e1": (-0.05, 2.618, 1.5, 50.0),
        "w0": (-3.059, 3.059, 4.0, 15.0),
        "w1": (-1.57079632679, 2.094, 4.0, 15.0),
        "w2": (-3.059, 3.059, 4.0, 15.0),
    }
    for name in ARM_JOINTS:
        lower, upper, speed, torque = limits[name.split("_")[1]]
        assert tuple(model.joint(name).range) == (lower, upper)
        assert tuple(model.actuator(name).ctrlrange) == (-speed, speed)
        assert tuple(model.actuator(name).forcerange) == (-torque, torque)


def test_links_have_the_urdf_names() -> None:
    model = build_model(SimulationSettings())
    names = {model.body(i).name for i in range(model.nbody)}
    links = "arm_mount upper_shoulder lower_shoulder upper_elbow lower_elbow upper_forearm "
    links += "lower_forearm wrist hand"
    for side in ("left", "right"):
        assert {f"{side}_{link}" for link in links.split()} <= names
    assert {"base", "torso", "pedestal", "head", "screen", "table"} <= names


def test_dustpan_is_left_and_brush_right() -> None:
    model = build_model(SimulationSettings())
    parent = {tool: model.body(model.body(tool).parentid[0]).name for tool in ("dustpan", "brush")}
    assert parent == {"dustpan": "left_hand", "brush": "right_hand"}


@pytest.mark.parametrize("pose", ["untucked", "neutral", "sweep_start"])
def test_keyframes_touch_nothing(pose: str) -> None:
    model = build_model(SimulationSettings())
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key(pose).id)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0


def test_sweep_and_the_way_to_it_touch_nothing() -> None:
    model = build_model(SimulationSettings())
    data = mujoco.MjData(model)
    motion = load_motion()
    assert motion.joints == ARM_JOINTS
    qpos = [model.joint(name).qposadr[0] for name in ARM_JOINTS]
    initial = model.key("untucked").qpos[qpos]
    way = initial + np.linspace(0, 1, 50)[:, None] * (motion.waypoints[0] - initial)
    back = motion.waypoints[-1] + np.linspace(0, 1, 50)[:, None] * (
        motion.waypoints[0] - motion.waypoints[-1]
    )
    sweep = [motion.at(time)[0] for time in np.linspace(0.0, motion.duration, 400)]
    for positions in [*way, *sweep, *back]:
        data.qpos[qpos] = positions
        mujoco.mj_forward(model, data)
        assert data.ncon == 0, [model.geom(contact.geom1).name for contact in data.contact]


def test_arms_meet_each_other_and_the_table() -> None:
    model = build_model(SimulationSettings())
    data = mujoco.MjData(model)
    qpos = [model.joint(name).qposadr[0] for name in ARM_JOINTS]
    start = model.key("sweep_start").qpos[qpos]
    into_table = start + 0.2 * np.array([name.endswith("s1") for name in ARM_JOINTS])
    hands_together = start.copy()
    hands_together[[0, 7]] += [-0.8, 0.8]
    hands_together[[1, 8]] -= 0.3
    bodies = {}
    for name, positions in {"table": into_table, "arms": hands_together}.items():
        data.qpos[qpos] = positions
        mujoco.mj_forward(model, data)
        ids = [model.geom_bodyid[[c.geom1, c.geom2]] for c in data.contact]
        bodies[name] = {frozenset(model.body(i).name for i in pair) for pair in ids}
    assert {frozenset({"table", "brush"}), frozenset({"table", "dustpan"})} <= bodies["table"]
    assert any(
        any(name.startswith(("left", "dustpan")) for name in pair)
        and any(name.startswith(("right", "brush")) for name in pair)
        for pair in bodies["arms"]
    )
