"""The kinds of compression that are made here: a library that is missing takes its kind along."""

from service.encoders.format import Compression
from service.encoders.gltf import meshopt


def compressions() -> tuple[Compression, ...]:
    """All of them, beside `none`."""
    return ("meshopt",) if meshopt.available() else ()


def made_by(compression: Compression) -> str:
    """What the bytes of a kind depend on, beside the content: the version of its library."""
    return f"meshopt {meshopt.library_version()}" if compression == "meshopt" else ""
