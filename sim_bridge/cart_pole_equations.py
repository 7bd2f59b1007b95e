"""The cart-pole's equations of motion (thesis (4.1)-(4.2)) and their integration.

A cart on a track carries a pole that swings freely; a force pushes the cart. theta is 0 where the
pole hangs and grows anticlockwise, so that the tip is at x + l sin(theta), -l cos(theta).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

CART_POLE_MODEL = Path(__file__).parent / "models" / "cart_pole" / "cart_pole.xml"
"""The same system for MuJoCo, to look at."""

STEP = 1e-3  # [s] of the Runge-Kutta steps: errors stay below 1e-8 over 0.1 s


@dataclass(frozen=True)
class CartPoleParameters:
    """The thesis's cart-pole, which is PILCO's (Deisenroth & Rasmussen 2011).

    Attributes:
        cart_mass: m1 [kg].
        pole_mass: m2 [kg], spread evenly over a thin rod.
        length: l of the pole [m].
        friction: b between cart and track [N s/m].
        gravity: g [m/s^2].
    """

    cart_mass: float = 0.5
    pole_mass: float = 0.5
    length: float = 0.5
    friction: float = 0.1
    gravity: float = 9.82


def accelerations(
    theta: float,
    x_dot: float,
    theta_dot: float,
    force: float,
    parameters: CartPoleParameters,
) -> tuple[float, float]:
    """Return the accelerations of cart [m/s^2] and pole [rad/s^2], thesis (4.1)-(4.2).

    (4 M - 3 m2 cos^2) x'' = 2 m2 l theta'^2 sin + 3 m2 g sin cos + 4 (u - b x')
    (4 M - 3 m2 cos^2) l theta'' = -3 m2 l theta'^2 sin cos - 6 M g sin - 6 (u - b x') cos
    with M = m1 + m2.
    """
    p = parameters
    sine, cosine = math.sin(theta), math.cos(theta)
    total = p.cart_mass + p.pole_mass
    inertia = 4.0 * total - 3.0 * p.pole_mass * cosine * cosine
    push = force - p.friction * x_dot
    swing = p.pole_mass * p.length * theta_dot * theta_dot * sine
    cart = (2.0 * swing + 3.0 * p.pole_mass * p.gravity * sine * cosine + 4.0 * push) / inertia
    pole = -3.0 * swing * cosine - 6.0 * total * p.gravity * sine - 6.0 * push * cosine
    return cart, pole / (inertia * p.length)


def integrate(
    state: Vector, force: float, duration: float, parameters: CartPoleParameters
) -> Vector:
    """Return the state after a while of constant force, by classical Runge-Kutta of order 4.

    Args:
        state: [x, theta, x_dot, theta_dot], shape (4,) [m, rad, m/s, rad/s].
        force: u on the cart [N].
        duration: [s], cut into equal steps of at most 1 ms.
        parameters: The cart-pole.
    """
    steps = max(1, math.ceil(duration / STEP - 1e-9))
    h = duration / steps
    x, theta, v, w = (float(value) for value in state)
    for _ in range(steps):
        a1, b1 = accelerations(theta, v, w, force, parameters)
        v2, w2 = v + 0.5 * h * a1, w + 0.5 * h * b1
        a2, b2 = accelerations(theta + 0.5 * h * w, v2, w2, force, parameters)
        v3, w3 = v + 0.5 * h * a2, w + 0.5 * h * b2
        a3, b3 = accelerations(theta + 0.5 * h * w2, v3, w3, force, parameters)
        v4, w4 = v + h * a3, w + h * b3
        a4, b4 = accelerations(theta + h * w3, v4, w4, force, parameters)
        x += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4)
        theta += h / 6.0 * (w + 2.0 * w2 + 2.0 * w3 + w4)
        v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
        w += h / 6.0 * (b1 + 2.0 * b2 + 2.0 * b3 + b4)
    return np.array([x, theta, v, w])


def energy(state: Vector, parameters: CartPoleParameters) -> float:
    """Return kinetic and potential energy [J], zero where the pole hangs at rest."""
    _, theta, v, w = state
    p = parameters
    moving = 0.5 * (p.cart_mass + p.pole_mass) * v * v
    turning = p.pole_mass * p.length * (p.length * w * w / 6.0 + 0.5 * v * w * math.cos(theta))
    height = 0.5 * p.length * (1.0 - math.cos(theta))
    return float(moving + turning + p.pole_mass * p.gravity * height)


def tip_distance(states: Vector, parameters: CartPoleParameters) -> Vector:
    """Return how far the pole's tip is from the point above the track's origin [m].

    Args:
        states: Shape (..., 4).
        parameters: The cart-pole.
    """
    x, theta = states[..., 0], states[..., 1]
    across = x + parameters.length * np.sin(theta)
    below = parameters.length * (1.0 + np.cos(theta))
    distance: Vector = np.hypot(across, below)
    return distance
