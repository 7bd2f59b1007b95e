"""Meshes of links, as far as they can be read here."""

from __future__ import annotations

import sys
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from irlpilco_ros.learning.numerics.arrays import Array

COLLADA = ".dae"


def can_be_read(path: Path) -> bool:
    """Whether this kind of mesh can be read with what is installed; says once what is missing."""
    if path.suffix.lower() != COLLADA or find_spec("collada"):
        return True
    _tell(
        "meshes in .dae need pycollada (pip install pycollada); without it the shapes for "
        "collisions are shown instead"
    )
    return False


@cache
def read_mesh(path: Path) -> tuple[Array, Array] | None:
    """Return vertices (n, 3) and triangles (m, 3) of a mesh; None, told, if it cannot be read."""
    import trimesh  # comes with viser

    try:
        mesh = trimesh.load(path, force="mesh", process=False)
        vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    except Exception as error:  # whatever a reader raises for a file that is damaged
        _tell(f"the mesh {path} is left out: {error}")
        return None
    if not len(faces):
        _tell(f"the mesh {path} is left out: it has no triangles")
        return None
    return vertices, faces


@cache
def _tell(sentence: str) -> None:
    print(sentence, file=sys.stderr)
