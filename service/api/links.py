"""URLs of surfaces and of their meshes.

`root` is the path that the service is mounted at, often empty; the URLs begin with it. `surface` is
the id of a surface.
"""

from starlette.types import Scope

from service.encoders.registry import FORMATS
from service.engine.mesh.report import ENGINE


def surface_url(root: str, surface: str) -> str:
    """The URL of a surface."""
    return f"{root}/v1/surfaces/{surface}"


def mesh_url_path(root: str, surface: str, suffix: str) -> str:
    """The URL of a surface's meshes in one format, without a query."""
    return f"{surface_url(root, surface)}/mesh.{suffix}"


def mesh_url(root: str, surface: str, suffix: str, query: str = f"engine={ENGINE}") -> str:
    """The URL of a mesh.

    If `query` is not given, it is `engine=…` alone: the default options, and the present version
    (`ENGINE`) of the numbers that the service computes.
    """
    return f"{mesh_url_path(root, surface, suffix)}?{query}"


def mesh_links(root: str, surface: str) -> dict[str, str]:
    """The canonical URLs of a surface's meshes with default options, by suffix."""
    return {fmt.suffix: mesh_url(root, surface, fmt.suffix) for fmt in FORMATS}


def route_path(scope: Scope) -> str:
    """The path of a request below the mount point of the application."""
    path: str = scope["path"]
    root: str = scope.get("root_path", "")
    return path[len(root) :] if root and path.startswith(root + "/") else path
