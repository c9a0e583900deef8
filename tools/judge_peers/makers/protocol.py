"""How a maker of meshes is asked: one line of JSON for each mesh, and one line as the answer.

A request has `file`, the surface; `out`, the .npz file to write, with `vertices` (n, 3) and `faces`
(t, 3); and the wishes of the maker. The answer has `seconds`, the CPU time of the mesher alone, or
`error`. Libraries print messages of their own, so lines of answers begin with `MARK`.

Only the standard library and NumPy are imported here: no maker's Python has the service.
"""

import json
import resource
import sys
import time
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

MARK = "answer "
"""The first characters of a line that is an answer."""

MAX_BYTES = 8 << 30
"""The memory that a maker may take; some ask for all that there is."""

Fields: TypeAlias = dict[str, Any]

Mesher: TypeAlias = Callable[[], tuple[Any, Any]]
"""Makes the mesh: vertices (n, 3) and faces (t, 3)."""


def serve(version: str, load: Callable[[Fields], Mesher]) -> None:
    """Answers requests until the input ends.

    Parameters
    ----------
    load : callable
        Reads the surface of a request, and returns the function that makes its mesh, whose time
        counts.
    """
    resource.setrlimit(resource.RLIMIT_AS, (MAX_BYTES, MAX_BYTES))
    _answer({"version": version})
    for line in sys.stdin:
        request = json.loads(line)
        try:
            mesh = load(request)
            start = time.process_time()
            vertices, faces = mesh()
            seconds = time.process_time() - start
            faces = np.asarray(faces, dtype=np.int64).reshape(-1, 3)
            if not len(faces):
                raise ValueError("no triangles")
            np.savez(request["out"], vertices=np.asarray(vertices, dtype=np.float64), faces=faces)
            _answer({"seconds": seconds})
        except Exception as error:  # any error means that no mesh was made
            text = " ".join(str(error).split()) or type(error).__name__
            _answer({"error": text[:200]})


def _answer(fields: Fields) -> None:
    print(f"\n{MARK}{json.dumps(fields)}", flush=True)
