"""Closest points and hits of rays on a STEP file by Open CASCADE, in a Python of its own.

    python -m tools.benchmarks.part_queries_worker

The program reads names of .npz files, one in each line. For each it writes the file
`<name>.out.npz`, and then prints `done`. An input file has the `path` of a STEP file, `points`
(N, 3), and `origins` and `directions` (M, 3) of rays. An output file has `distances` (N,), ∞ where
there is none; `counts` (M,) of hits and `first` (M,), the distances of first hits; and seconds of
CPU time: to prepare the shape for points and for rays, for all points, for all hits, and for first
hits. The file is read before.
"""

import sys
import time
from typing import Any

import numpy as np
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.gp import gp_Dir, gp_Lin, gp_Pnt
from OCP.IntCurvesFace import IntCurvesFace_ShapeIntersector
from OCP.STEPControl import STEPControl_Reader

TOLERANCE = 1e-7
"""The tolerance of hits: the library's own for points that are one."""


def read(path: str) -> Any:
    """The shape of a STEP file."""
    reader = STEPControl_Reader()
    reader.ReadFile(path)
    reader.TransferRoots()
    return reader.OneShape()


def answer(arrays: Any) -> dict[str, Any]:
    """The answers and times for one input file."""
    shape = read(str(arrays["path"]))
    vertices = [BRepBuilderAPI_MakeVertex(gp_Pnt(*p)).Vertex() for p in arrays["points"].tolist()]
    rays = zip(arrays["origins"].tolist(), arrays["directions"].tolist(), strict=True)
    lines = [gp_Lin(gp_Pnt(*o), gp_Dir(*d)) for o, d in rays]
    times = [time.process_time()]
    search = BRepExtrema_DistShapeShape()
    search.LoadS2(shape)
    hits = IntCurvesFace_ShapeIntersector()
    hits.Load(shape, TOLERANCE)
    times.append(time.process_time())
    distances = []
    for vertex in vertices:
        search.LoadS1(vertex)
        search.Perform()
        distances.append(search.Value() if search.IsDone() and search.NbSolution() else np.inf)
    times.append(time.process_time())
    counts = []
    for line in lines:
        hits.Perform(line, 0.0, np.inf)
        counts.append(hits.NbPnt() if hits.IsDone() else 0)
    times.append(time.process_time())
    first = []
    for line in lines:
        hits.PerformNearest(line, 0.0, np.inf)
        first.append(hits.WParameter(1) if hits.IsDone() and hits.NbPnt() else np.inf)
    times.append(time.process_time())
    seconds = np.diff(times)
    return {"distances": distances, "counts": counts, "first": first, "seconds": seconds}


def main() -> None:
    """Answers files until the input ends."""
    for line in sys.stdin:
        name = line.strip()
        np.savez(f"{name}.out.npz", **answer(np.load(name)))
        print("done", flush=True)


if __name__ == "__main__":
    main()
