"""The simulation in a window, for whoever sits in front of one."""

from __future__ import annotations

import os
import time
from typing import Any

from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.errors import RenderingError

_FRAME = 1.0 / 30.0  # [s] between two pictures
_LOOK_AT = (0.5, 0.0, 0.1)  # [m], above the middle of the table
_DISTANCE = 2.2  # [m]
_AZIMUTH, _ELEVATION = 180.0, -25.0  # [deg]: from the front, somewhat from above


class Viewer:
    """MuJoCo's passive viewer; closing the window does not stop the simulation."""

    def __init__(self, simulation: BaxterSimulation) -> None:
        """Open the window.

        Raises:
            RenderingError: there is no display, or no window can be opened on it.
        """
        if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            raise RenderingError(
                "the viewer needs a display, and neither DISPLAY nor WAYLAND_DISPLAY is set; set "
                "the parameter viewer to false (pictures without a display: irlpilco report)"
            )
        import mujoco.viewer  # slow, and of no use without a display

        try:
            self._handle: Any = mujoco.viewer.launch_passive(
                simulation.model, simulation.data, show_left_ui=False, show_right_ui=False
            )
        except Exception as error:
            raise RenderingError(
                f"cannot open a window on the display: {error}; set the parameter viewer to false"
            ) from error
        with self._handle.lock():
            self._handle.cam.lookat[:] = _LOOK_AT
            self._handle.cam.distance = _DISTANCE
            self._handle.cam.azimuth, self._handle.cam.elevation = _AZIMUTH, _ELEVATION
        self._next_frame = time.monotonic()

    def update(self) -> None:
        """Show the present state; does nothing most of the time, to draw 30 pictures a second."""
        if time.monotonic() >= self._next_frame and self._handle.is_running():
            self._next_frame = time.monotonic() + _FRAME
            self._handle.sync()

    def close(self) -> None:
        """Close the window."""
        self._handle.close()
