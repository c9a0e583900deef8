"""The kinds of compression whose libraries are installed."""

from service.encoders.format import Compression
from service.encoders.gltf import meshopt


def compressions() -> tuple[Compression, ...]:
    """All kinds of compression except `none`."""
    return ("meshopt",) if meshopt.available() else ()


def find_version(compression: Compression) -> str:
    """The version of the library: another version may compress the same content to other bytes."""
    return f"meshopt {meshopt.library_version()}" if compression == "meshopt" else ""
