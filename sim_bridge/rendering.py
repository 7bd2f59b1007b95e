"""Pictures of the simulation without a screen: EGL, else OSMesa, else a clear word."""

from __future__ import annotations

import ctypes
import os
import types
from collections.abc import Callable
from functools import cache
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_bridge.baxter_simulation import BaxterSimulation
from sim_bridge.errors import RenderingError

Image = NDArray[np.uint8]

CAMERAS = ("front", "sweep")
_EGL_LIBRARY = "libEGL.so.1"
_OSMESA_LIBRARIES = ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")


def can_render() -> bool:
    """Return whether pictures can be drawn here."""
    try:
        _gl_context()
    except RenderingError:
        return False
    return True


class FrameRenderer:
    """Draws a simulation's present state; a context manager that frees its memory at the end.

    with FrameRenderer(simulation, 640, 360) as renderer:
        image = renderer.frame()  # (360, 640, 3) of uint8
    """

    def __init__(
        self,
        simulation: BaxterSimulation,
        width: int = 640,
        height: int = 360,
        camera: str = "sweep",
    ) -> None:
        """Prepare to draw.

        Args:
            simulation: The robot.
            width: Of the picture, at most 1920 pixels.
            height: Of the picture, at most 1080 pixels.
            camera: One of CAMERAS.

        Raises:
            RenderingError: neither EGL nor OSMesa works here, or there is no such camera.
        """
        if camera not in CAMERAS:
            raise RenderingError(f"there is no camera {camera!r}; available: {', '.join(CAMERAS)}")
        self._simulation = simulation
        self._rect = mujoco.MjrRect(0, 0, width, height)
        self._gl = _gl_context()(width, height)
        self._gl.make_current()
        model = simulation.model
        self._scene = mujoco.MjvScene(model, maxgeom=1000)
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._camera.fixedcamid = model.camera(camera).id
        self._options = mujoco.MjvOption()

    def __enter__(self) -> FrameRenderer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: types.TracebackType | None,
    ) -> None:
        self._context.free()
        self._gl.free()

    def frame(self) -> Image:
        """Return a picture of the present state, shape (height, width, 3)."""
        self._gl.make_current()
        model, data = self._simulation.model, self._simulation.data
        everything = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(
            model, data, self._options, None, self._camera, everything, self._scene
        )
        mujoco.mjr_render(self._rect, self._scene, self._context)
        image = np.empty((self._rect.height, self._rect.width, 3), dtype=np.uint8)
        mujoco.mjr_readPixels(image, None, self._rect, self._context)
        return image[::-1].copy()


@cache
def _gl_context() -> Callable[[int, int], Any]:
    """Return the class that makes an off-screen OpenGL context.

    Raises:
        RenderingError: nothing here draws without a screen; says which packages to install.
    """
    wanted = os.environ.get("MUJOCO_GL", "").lower()
    # PyOpenGL settles on one platform per process, so look before importing either.
    if wanted in ("", "egl") and _egl_has_devices():
        os.environ["PYOPENGL_PLATFORM"] = "egl"
        from mujoco.egl import GLContext

        return GLContext  # type: ignore[no-any-return]
    if wanted in ("", "osmesa") and any(_loads(name) for name in _OSMESA_LIBRARIES):
        os.environ["PYOPENGL_PLATFORM"] = "osmesa"
        from mujoco.osmesa import GLContext

        return GLContext  # type: ignore[no-any-return]
    asked = f" (MUJOCO_GL is {wanted!r})" if wanted else ""
    raise RenderingError(
        f"no pictures on this machine: neither EGL nor OSMesa can draw{asked}; install the Debian "
        "packages libegl1 and libegl-mesa0 (or libosmesa6), for example: "
        "sudo apt install libegl1 libegl-mesa0"
    )


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _egl_has_devices() -> bool:
    """Whether EGL is installed and has a driver; libegl1 alone has none."""
    if not _loads(_EGL_LIBRARY):
        return False
    library = ctypes.CDLL(_EGL_LIBRARY)
    library.eglGetProcAddress.restype = ctypes.c_void_p
    address = library.eglGetProcAddress(b"eglQueryDevicesEXT")
    if not address:
        return False
    prototype = ctypes.CFUNCTYPE(
        ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, ctypes.POINTER(ctypes.c_int)
    )
    count = ctypes.c_int(0)
    succeeded = prototype(address)(0, None, ctypes.byref(count))
    return bool(succeeded) and count.value > 0
