"""Compile the model of Baxter at its table, as the settings ask for it."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from sim_bridge.debris import add_debris
from sim_bridge.joints import ARM_JOINTS
from sim_bridge.servo_presets import SERVO_PRESETS
from sim_bridge.simulation_settings import SimulationSettings

SCENE = Path(__file__).parent / "models" / "baxter" / "scene.xml"
_PAYLOAD_PLACE = (0.0, 0.0, 0.08)  # [m] in the hand frame
_PAYLOAD_RADIUS = 0.03  # [m], of a solid sphere
_OBSTACLE_RADIUS = 0.05  # [m]


def build_model(settings: SimulationSettings) -> mujoco.MjModel:
    """Return the compiled scene with these servos, payloads, obstacle and debris."""
    spec = mujoco.MjSpec.from_file(str(SCENE))
    if settings.payload > 0.0:
        for side in ("left", "right"):
            _add_payload(spec.body(f"{side}_hand"), settings.payload)
    if settings.obstacle:
        _add_obstacle(spec, settings.obstacle)
    add_debris(spec, settings.debris, settings.debris_seed)
    model = spec.compile()
    preset = SERVO_PRESETS[settings.preset]
    for joint in ARM_JOINTS:
        actuator = model.actuator(joint)
        actuator.gainprm[0] = preset.gain(joint)
        actuator.biasprm[2] = -preset.gain(joint)
    return model


def _add_obstacle(spec: mujoco.MjSpec, place: tuple[float, ...]) -> None:
    """Put a ball into the scene that both arms collide with, as they do with the table."""
    spec.worldbody.add_geom(
        name="obstacle",
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        pos=place,
        size=[_OBSTACLE_RADIUS, 0.0, 0.0],
        contype=4,
        conaffinity=0,
        rgba=[0.8, 0.1, 0.1, 1.0],
    )


def _add_payload(hand: mujoco.MjsBody, mass: float) -> None:
    """Put a ball into the hand that gravity compensation does not carry."""
    inertia = 0.4 * mass * _PAYLOAD_RADIUS**2
    hand.add_body(
        name=hand.name.replace("hand", "payload"),
        pos=_PAYLOAD_PLACE,
        mass=mass,
        ipos=np.zeros(3),
        inertia=np.full(3, inertia),
        explicitinertial=True,
        gravcomp=0.0,
    )
