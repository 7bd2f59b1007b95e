"""A robot in viser's scene: a tree of frames, of which the joints' are turned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from irlpilco_ros.kinematics.rigid_motion import quaternion_of
from irlpilco_ros.learning.numerics.arrays import Array
from irlpilco_ros.view.mesh_file import read_mesh
from irlpilco_ros.view.urdf_look import Link, Shape

_MOVING = ("revolute", "continuous", "prismatic")
_BYTE = 255


class RobotDrawing:
    """One robot, solid or as a ghost."""

    def __init__(
        self,
        server: Any,
        name: str,
        links: Sequence[Link],
        tint: tuple[float, float, float, float] | None = None,
    ) -> None:
        """Draw it with its joints at zero.

        Args:
            server: A viser.ViserServer.
            name: Of its root in the scene.
            links: What it looks like, parents before their children.
            tint: Colour and opacity of a ghost, of which only what moves is drawn; None for the
                robot itself.
        """
        self._scene = server.scene
        self._server = server
        self._tint = tint
        self.root = self._scene.add_frame(f"/{name}", show_axes=False)
        self._joints: dict[str, tuple[Link, Any]] = {}
        self._frames: dict[str, tuple[Link, Any]] = {}
        moving: set[str] = set()
        paths: dict[str, str] = {"": f"/{name}"}
        for number, link in enumerate(links):
            path = f"{paths[link.parent]}/{number}"
            paths[link.name] = path
            frame = self._scene.add_frame(path, show_axes=False, **_placed(link.moved(0.0)))
            self._frames[link.name] = link, frame
            if link.kind in _MOVING:
                self._joints[link.joint] = link, frame
            if link.kind in _MOVING or link.parent in moving:
                moving.add(link.name)
            if tint is None or link.name in moving:
                for each, shape in enumerate(link.shapes):
                    self._draw(f"{path}/shape{each}", shape)

    def move(self, positions: Mapping[str, float]) -> None:
        """Put joints at positions [rad], or [m]; those it has not are left alone."""
        with self._server.atomic():
            for joint, position in positions.items():
                if joint in self._joints:
                    link, frame = self._joints[joint]
                    placed = _placed(link.moved(position))
                    frame.wxyz, frame.position = placed["wxyz"], placed["position"]

    def place(self, name: str, pose: Array | None) -> None:
        """Put a link into a pose (4, 4) in its parent's frame, or back for None, if it is there."""
        if name in self._frames:
            link, frame = self._frames[name]
            placed = _placed(link.origin if pose is None else pose)
            frame.wxyz, frame.position = placed["wxyz"], placed["position"]

    def _draw(self, path: str, shape: Shape) -> None:
        colour = shape.colour if self._tint is None else self._tint
        look: dict[str, Any] = {
            "color": tuple(round(_BYTE * part) for part in colour[:3]),
            "opacity": colour[3] if len(colour) > 3 and colour[3] < 1.0 else None,
            **_placed(shape.place),
        }
        if shape.kind == "box":
            self._scene.add_box(path, dimensions=shape.size, **look)
        elif shape.kind == "sphere":
            self._scene.add_icosphere(path, radius=shape.size[0], subdivisions=2, **look)
        elif shape.kind == "cylinder":
            self._scene.add_cylinder(path, radius=shape.size[0], height=shape.size[1], **look)
        elif shape.file is not None:
            mesh = read_mesh(shape.file)
            if mesh is not None:
                vertices, faces = mesh
                self._scene.add_mesh_simple(
                    path, vertices=vertices * shape.size, faces=faces, **look
                )


def _placed(pose: Array) -> dict[str, tuple[float, ...]]:
    """Return a pose as viser has it: quaternions are w, x, y, z."""
    x, y, z, w = map(float, quaternion_of(pose))
    return {"wxyz": (w, x, y, z), "position": tuple(map(float, pose[:3, 3]))}
