"""Pictures as values: the bytes of a PNG file, which a notebook shows."""


class Picture(bytes):
    """A PNG file: `Path("picture.png").write_bytes(picture)` writes it; a notebook shows it."""

    def __repr__(self) -> str:
        return f"Picture({len(self)} bytes)"

    def _repr_png_(self) -> bytes:
        """The file, for IPython."""
        return bytes(self)
