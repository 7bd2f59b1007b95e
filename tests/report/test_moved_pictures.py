"""Pictures of one sweep at several places: each with the pile where it lay."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from irlpilco_ros.report.moved_pictures import Swept, moved_animation
from irlpilco_ros.report.resimulation import film
from sim_bridge.guided_motion import GuidedMotion
from sim_bridge.motion_files import load_motion
from sim_bridge.rendering import can_render

pytestmark = pytest.mark.skipif(not can_render(), reason="needs libegl1 or libosmesa6")


@pytest.fixture
def still() -> GuidedMotion:
    """The begin of the sweep, for half a second."""
    shown = load_motion()
    return GuidedMotion(shown.joints, 0.5, np.stack([shown.at(0.0)[0]] * 2))


def test_each_is_labelled_with_its_place(still: GuidedMotion) -> None:
    assert Swept(still, (0.0, 0.0, 0.0)).label == "learned here"
    assert Swept(still, (0.05, -0.03, 0.2)).label == "at once: +0.05, -0.03 m, +0.20 rad"


def test_the_pile_is_drawn_where_it_lies(still: GuidedMotion) -> None:
    here, there = (
        film(still, 1, place).frames[0].astype(int) for place in ((0,) * 3, (0.08, 0, 0))
    )
    changed = np.abs(here - there).max(axis=2) > 40
    assert 20 < changed.sum() < 0.05 * changed.size


def test_four_are_drawn_two_in_a_row(still: GuidedMotion) -> None:
    places = [(0.0, 0.0, 0.0), (0.05, 0.0, 0.0), (0.0, 0.05, 0.0), (0.0, 0.0, 0.3), (0.1, 0.1, 0.0)]
    picture = Image.open(io.BytesIO(moved_animation([Swept(still, each) for each in places], 1)))
    assert picture.size[0] > 2 * 480
    assert 2 * 320 < picture.size[1] < 3 * 320
