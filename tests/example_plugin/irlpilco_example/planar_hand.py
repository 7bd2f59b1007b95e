"""A feature: where the hand of a planar arm is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from irlpilco_ros.learning.features import CubatureFeatures
from irlpilco_ros.learning.settings import setting


class PlanarHand(CubatureFeatures):
    """x and y of the hand of an arm in a plane [m]."""

    @dataclass(frozen=True)
    class Settings:
        link: float = setting(0.5, "Length of each link of the arm.", unit="m", minimum=0.01)

    @classmethod
    def of_robot(cls, joints, settings):
        """Return the hand of an arm with these joints."""
        return cls(len(joints.names), partial(hand, link=settings.link), ("m", "m"))


def hand(points, link=0.5):
    """Return the hand's places (m, 2) [m] at joint angles (m, J) [rad], and their Jacobians."""
    angles = np.cumsum(points, axis=1)
    links = link * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    turned = np.stack([-links[:, 1], links[:, 0]], axis=1)  # a joint moves all links after it
    return links.sum(axis=2), np.cumsum(turned[:, :, ::-1], axis=2)[:, :, ::-1]
