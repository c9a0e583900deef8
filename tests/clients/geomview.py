"""Geomview's own reader: `anytooff` loads an OOGL file and writes it as OFF."""

import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.programs import find_program


@dataclass(frozen=True)
class Read:
    """A file as Geomview read it: vertices as it stores them, float32, and faces.

    `colors`, red, green, blue and opacity, are None for a file without colours.
    """

    vertices: NDArray[np.float64]
    faces: list[list[int]]
    colors: NDArray[np.float64] | None


def read_oogl(content: bytes, folder: Path) -> Read:
    """Loads a file as Geomview does; fails if Geomview prints an error, even if it continues."""
    path = folder / "model.oogl"
    path.write_bytes(content)
    done = subprocess.run(
        [find_program("anytooff"), str(path)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    return _parse_off(done.stdout)


def _parse_off(text: str) -> Read:
    """The OFF in braces that `anytooff` writes: `{ [C][N]OFF counts vertices faces }`."""
    words = iter(text.split())
    keyword = next(word for word in words if word != "{")
    assert keyword.endswith("OFF"), keyword
    columns = 3 + 3 * ("N" in keyword) + 4 * ("C" in keyword)
    vertices, faces, _edges = (int(next(words)) for _ in range(3))
    table = np.array([[float(next(words)) for _ in range(columns)] for _ in range(vertices)])
    # Each face is on a line of its own; its colour may follow it.
    lines = [line.split() for line in text.strip().rstrip("}").splitlines() if line.strip()]
    loops = [[int(word) for word in line[1 : 1 + int(line[0])]] for line in lines[-faces:]]
    return Read(table[:, :3], loops, table[:, -4:] if "C" in keyword else None)
