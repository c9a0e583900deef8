"""The kinds of compression whose libraries are installed."""

from service.encoders.format import Compression
from service.encoders.gltf import meshopt


def compressions() -> tuple[Compression, ...]:
    """All kinds but `none`."""
    return ("meshopt",) if meshopt.available() else ()


def made_by(compression: Compression) -> str:
    """The library's version, on which the bytes of a kind depend beside the content."""
    return f"meshopt {meshopt.library_version()}" if compression == "meshopt" else ""
