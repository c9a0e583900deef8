"""trimesh, without the libraries that it could use in addition.

It has functions that read files to arrays, before it makes meshes of them: so nothing is merged,
computed or left out. To import it takes 0.3 s; with SciPy and others that may be installed beside
it, 1.5 s. Without Pillow it can open no picture, and without others no network and no archive.
"""

import sys
from collections.abc import Callable, Mapping, Sequence
from importlib.machinery import ModuleSpec, PathFinder
from io import BytesIO
from types import ModuleType
from typing import Any

ALLOWED = frozenset({*sys.stdlib_module_names, "numpy", "service", "trimesh"})
"""Modules that trimesh may import, and all in them."""


class _Allowed:
    """A finder of modules that finds no other library."""

    @staticmethod
    def find_spec(
        name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """The module, or None as if it were not installed."""
        if name.partition(".")[0] not in ALLOWED:
            return None
        return PathFinder.find_spec(name, path, target)


def import_trimesh() -> None:
    """Imports trimesh alone, in a process that reads one file: it finds no others from now on."""
    others = [finder for finder in sys.meta_path if finder is not PathFinder]
    sys.meta_path[:] = [*others, _Allowed()]
    _loaders()


def load(name: str, content: bytes, **options: bool) -> Mapping[str, Any]:
    """The arrays that trimesh reads from a file without names that refer to other files.

    Parameters
    ----------
    name : str
        `glb`, `obj`, `off`, `ply` or `stl`.
    **options
        Those of trimesh's function for the format.

    Returns
    -------
    Mapping
        `vertices`, `faces` and, if the file has them, `vertex_normals`; for GLB, `geometry` with
        such a mapping for each mesh.
    """
    loaded: Mapping[str, Any] = _loaders()[name](BytesIO(content), **options)
    return loaded


def _loaders() -> Mapping[str, Callable[..., Any]]:
    from trimesh.exchange import gltf, obj, off, ply, stl  # noqa: PLC0415  (only in a child)

    return {
        "glb": gltf.load_glb,
        "obj": obj.load_obj,
        "off": off.load_off,
        "ply": ply.load_ply,
        "stl": stl.load_stl,
    }
