"""Reads OOGL files with Geomview: its program `anytooff` loads a file and writes it as OFF."""

import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tools.programs import find_program


@dataclass(frozen=True)
class GeomviewMesh:
    """The vertices and faces that Geomview read from a file.

    `vertices` (N, 3) are rounded to float32, as Geomview stores them. `faces` are lists of vertex
    indices. `colors` (N, 4), red, green, blue and opacity, are None for a file without colours.
    """

    vertices: NDArray[np.float64]
    faces: list[list[int]]
    colors: NDArray[np.float64] | None


def read_oogl(content: bytes, folder: Path) -> GeomviewMesh:
    """The mesh that Geomview reads from `content`; the test fails if Geomview prints an error.

    The content is written to a file in `folder`.
    """
    path = folder / "model.oogl"
    path.write_bytes(content)
    process = subprocess.run(
        [find_program("anytooff"), str(path)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (process.returncode, process.stderr) == (0, ""), process.stderr
    return _parse_off(process.stdout)


def _parse_off(text: str) -> GeomviewMesh:
    """Parses the output of `anytooff`: `{ [C][N]OFF counts vertices faces }`."""
    words = iter(text.split())
    keyword = next(word for word in words if word != "{")
    assert keyword.endswith("OFF"), keyword
    columns = 3 + 3 * ("N" in keyword) + 4 * ("C" in keyword)
    vertex_count, face_count, _edge_count = (int(next(words)) for _ in range(3))
    table = np.array([[float(next(words)) for _ in range(columns)] for _ in range(vertex_count)])
    # The last lines are the faces: the number of corners, the corners, and maybe a colour.
    lines = [line.split() for line in text.strip().rstrip("}").splitlines() if line.strip()]
    faces = [[int(word) for word in line[1 : 1 + int(line[0])]] for line in lines[-face_count:]]
    return GeomviewMesh(table[:, :3], faces, table[:, -4:] if "C" in keyword else None)
