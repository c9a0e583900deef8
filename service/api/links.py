"""Addresses of surfaces and of their meshes, below the path that the service is mounted at."""

from starlette.types import Scope

from service.encoders.registry import FORMATS
from service.engine.mesh.report import ENGINE


def surface_address(root: str, surface: str) -> str:
    """Where a surface is."""
    return f"{root}/v1/surfaces/{surface}"


def mesh_path(root: str, surface: str, suffix: str) -> str:
    """Where its meshes of one format are, in whichever numbers are computed."""
    return f"{surface_address(root, surface)}/mesh.{suffix}"


def mesh_address(root: str, surface: str, suffix: str, query: str = f"engine={ENGINE}") -> str:
    """Where a mesh of it is; with no other query, the one of all defaults, in these numbers."""
    return f"{mesh_path(root, surface, suffix)}?{query}"


def mesh_links(root: str, surface: str) -> dict[str, str]:
    """Where its meshes are, by suffix: canonical addresses."""
    return {fmt.suffix: mesh_address(root, surface, fmt.suffix) for fmt in FORMATS}


def route_path(scope: Scope) -> str:
    """The path below the one that the application is mounted at."""
    path: str = scope["path"]
    root: str = scope.get("root_path", "")
    return path[len(root) :] if root and path.startswith(root + "/") else path
