"""Which kinds of compression this installation supports."""

from service.encoders.format import Compression
from service.encoders.gltf import meshopt


def list_compressions() -> tuple[Compression, ...]:
    """The kinds of compression whose library is installed, without `none`."""
    return ("meshopt",) if meshopt.is_available() else ()


def find_version(compression: Compression) -> str:
    """The name and version of the library of a compression; "" for `none`.

    Another version may compress the same content to other bytes.
    """
    return f"meshopt {meshopt.library_version()}" if compression == "meshopt" else ""
