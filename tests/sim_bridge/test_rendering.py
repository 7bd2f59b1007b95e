"""Pictures without a screen, and what is said where there can be none."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from sim_bridge import rendering
from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.errors import RenderingError
from sim_bridge.motion_files import load_motion
from sim_bridge.rendering import CAMERAS, FrameRenderer, can_render
from sim_bridge.simulation_settings import SimulationSettings
from sim_bridge.viewer import Viewer

needs_graphics = pytest.mark.skipif(not can_render(), reason="neither EGL nor OSMesa here")


@pytest.fixture
def forgetful() -> Iterator[None]:
    """Look for OpenGL anew, before and after."""
    rendering._gl_context.cache_clear()
    yield
    rendering._gl_context.cache_clear()


@needs_graphics
@pytest.mark.parametrize("camera", CAMERAS)
def test_picture_shows_the_robot_and_its_motion(camera: str) -> None:
    robot = BaxterSimulation(SimulationSettings(debris=4))
    with FrameRenderer(robot, 320, 200, camera) as renderer:
        before = renderer.frame()
        again = renderer.frame()
        robot.reset(positions=load_motion().waypoints[5])
        after = renderer.frame()
    assert np.abs(again.astype(int) - before).max() < 10, "the same but for dithering"
    assert before.shape == (200, 320, 3)
    assert before.dtype == np.uint8
    red, green, blue = (after[..., i].astype(int) for i in range(3))
    assert ((red > 60) & (red > 3 * green) & (red > 3 * blue)).mean() > 0.005, "the red arms"
    assert ((green > 60) & (green > 2 * red)).mean() > 0.003, "the green dustpan"
    assert (np.abs(after.astype(int) - before).max(axis=2) > 30).mean() > 0.05


@needs_graphics
def test_picture_is_upright() -> None:
    robot = BaxterSimulation()
    with FrameRenderer(robot, 320, 200, "front") as renderer:
        picture = renderer.frame().astype(int)
    is_table = (picture[..., 0] > 120) & (picture[..., 0] > picture[..., 2] + 40)
    assert is_table[100:].sum() > 5 * is_table[:60].sum()


def test_unknown_camera_lists_the_known_ones() -> None:
    with pytest.raises(RenderingError, match="available: front, sweep"):
        FrameRenderer(BaxterSimulation(), camera="back")


@pytest.mark.usefixtures("forgetful")
def test_without_opengl_the_packages_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(rendering, "_loads", lambda _library: False)
    assert not can_render()
    with pytest.raises(RenderingError, match="libegl1 and libegl-mesa0"):
        FrameRenderer(BaxterSimulation())


@pytest.mark.usefixtures("forgetful")
def test_wrong_platform_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "glfw")
    with pytest.raises(RenderingError, match="MUJOCO_GL is 'glfw'"):
        FrameRenderer(BaxterSimulation())


def test_viewer_without_a_display_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(RenderingError, match="needs a display"):
        Viewer(BaxterSimulation())
