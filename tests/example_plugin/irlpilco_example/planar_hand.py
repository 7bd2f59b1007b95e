"""A feature: where the hand of a planar arm is."""

from __future__ import annotations

import numpy as np

from irlpilco_ros.learning.features import CubatureFeatures

LINK = 0.5  # [m], each of them


class PlanarHand(CubatureFeatures):
    """x and y of the hand of an arm in a plane [m]."""

    @classmethod
    def of_robot(cls, joints):
        """Return the hand of an arm with these joints."""
        return cls(len(joints.names), hand, ("m", "m"))


def hand(points):
    """Return the hand's places (m, 2) [m] at joint angles (m, J) [rad], and their Jacobians."""
    angles = np.cumsum(points, axis=1)
    links = LINK * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    turned = np.stack([-links[:, 1], links[:, 0]], axis=1)  # a joint moves all links after it
    return links.sum(axis=2), np.cumsum(turned[:, :, ::-1], axis=2)[:, :, ::-1]
