"""Small things on the table to be swept up, scattered by a seed."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

# Where the brush passes on its way to the pan, in the base frame [m].
_LOWER = np.array([0.585, -0.23])
_UPPER = np.array([0.705, -0.07])
_TABLE_TOP = -0.12
_RADIUS = (0.007, 0.010)
_GAP = 0.002
_DENSITY = 900.0  # [kg/m^3]
_ROLLING_DAMPING = 2e-5  # [N s/m], [Nm s]: crumbs do not roll like ball bearings
# Crumbs give way: a hard one, caught between the pan and the table, would break the physics.
_SOFTNESS = (0.3, 0.7, 0.005, 0.5, 2.0)  # MuJoCo's solimp
_ARMATURE = 1e-6  # [kg m^2]
_COLOURS = ((0.90, 0.25, 0.16), (0.95, 0.60, 0.10), (0.97, 0.83, 0.20), (0.75, 0.30, 0.10))

# The inside of the pan in the frame of the body "dustpan" [m].
_PAN_LOWER = np.array([-0.12, -0.22, 0.10])
_PAN_UPPER = np.array([0.12, -0.02, 0.19])


def add_debris(spec: mujoco.MjSpec, count: int, seed: int) -> None:
    """Scatter pieces on the table, and extend the model's keyframes by where they lie."""
    rng = np.random.default_rng(seed)
    places: list[NDArray[np.float64]] = []
    for number in range(count):
        radius = rng.uniform(*_RADIUS)
        position = np.append(_free_place(rng, places), _TABLE_TOP + radius)
        places.append(position[:2])
        body = spec.worldbody.add_body(name=f"debris_{number}", pos=position)
        body.add_joint(
            name=f"debris_{number}",
            type=mujoco.mjtJoint.mjJNT_FREE,
            damping=np.full(3, _ROLLING_DAMPING),
            armature=_ARMATURE,
        )
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[radius, 0.0, 0.0],
            density=_DENSITY,
            rgba=[*_COLOURS[number % len(_COLOURS)], 1.0],
            contype=8,
            conaffinity=15,
            friction=[0.5, 0.005, 0.0001],
            solimp=_SOFTNESS,
            priority=1,
        )
        for key in spec.keys:
            key.qpos = np.concatenate([key.qpos, position, [1.0, 0.0, 0.0, 0.0]])


def _free_place(rng: np.random.Generator, places: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Draw places until one is clear of all others; a crowded table takes the last draw."""
    clear = 2.0 * _RADIUS[1] + _GAP
    place = rng.uniform(_LOWER, _UPPER)
    for _ in range(200):
        if all(np.linalg.norm(place - other) > clear for other in places):
            break
        place = rng.uniform(_LOWER, _UPPER)
    return np.asarray(place)


def debris_in_pan(model: mujoco.MjModel, data: mujoco.MjData) -> int:
    """Return how many pieces of debris lie inside the dustpan."""
    pan = data.body("dustpan")
    rotation = pan.xmat.reshape(3, 3)
    inside = 0
    for number in range(model.nbody):
        if model.body(number).name.startswith("debris_"):
            place = rotation.T @ (data.xpos[number] - pan.xpos)
            inside += bool(np.all(place > _PAN_LOWER) and np.all(place < _PAN_UPPER))
    return inside
