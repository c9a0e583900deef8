"""Closest points by another library, in a Python of its own, without the service.

    python closest_worker.py open_cascade | splinepy | geomdl

Reads names of .npz files, one in each line, and prints a line for each after it has written the
file `<name>.out.npz`. An input file has `nets` (K, n, m, 3) of Bézier patches and `points` (N, 3).
An output file has `distances` (N,), ∞ if nothing was found, and `seconds` of CPU time for all
patches. The time does not include building the library's surfaces, or other preparation for many
points.

Open CASCADE's Extrema searches for normals through the point. splinepy uses Newton's method from
the nearest of a grid of samples, by default 2 n samples for n control points. geomdl has no
function for closest points: this program uses its derivatives in Newton's method (The NURBS Book,
section 6.1), from the nearest of its samples.
"""

import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

SAMPLES, STEPS, ENOUGH = 10, 20, 1e-10
"""For geomdl: samples of a patch in each direction, most steps, and the change of a parameter that
ends them."""


def open_cascade(net: Any, points: Any) -> Callable[[], Iterator[float]]:
    """GeomAPI_ProjectPointOnSurf."""
    from OCP.collections import Array2_gp_Pnt  # noqa: PLC0415
    from OCP.Geom import Geom_BezierSurface  # noqa: PLC0415
    from OCP.GeomAPI import GeomAPI_ProjectPointOnSurf  # noqa: PLC0415
    from OCP.gp import gp_Pnt  # noqa: PLC0415

    rows, columns = net.shape[:2]
    array = Array2_gp_Pnt(1, rows, 1, columns)
    for i in range(rows):
        for j in range(columns):
            array.SetValue(i + 1, j + 1, gp_Pnt(*net[i, j].tolist()))
    surface = Geom_BezierSurface(array)
    places = [gp_Pnt(*point) for point in points.tolist()]

    def run() -> Iterator[float]:
        search = GeomAPI_ProjectPointOnSurf()
        search.Init(surface, 0.0, 1.0, 0.0, 1.0, 1e-9)
        for place in places:
            search.Perform(place)
            yield search.LowerDistance() if search.NbPoints() else np.inf

    return run


def splinepy(net: Any, points: Any) -> Callable[[], Iterator[float]]:
    """Bezier.proximities."""
    import splinepy as library  # noqa: PLC0415

    rows, columns = net.shape[:2]
    # In splinepy's order, the index of the first parameter varies fastest.
    surface = library.Bezier([rows - 1, columns - 1], net.transpose(1, 0, 2).reshape(-1, 3))

    def run() -> Iterator[float]:
        proximities = surface.proximities(
            points, [2 * rows, 2 * columns], nthreads=1, return_verbose=True
        )
        return iter(proximities[3].ravel().tolist())

    return run


def geomdl(net: Any, points: Any) -> Callable[[], Iterator[float]]:
    """Newton's method with geomdl's derivatives."""
    from geomdl.BSpline import Surface  # noqa: PLC0415

    surface = Surface()
    rows, columns = net.shape[:2]
    surface.degree_u, surface.degree_v = rows - 1, columns - 1
    surface.set_ctrlpts(net.reshape(-1, 3).tolist(), rows, columns)
    surface.knotvector_u = [0.0] * rows + [1.0] * rows
    surface.knotvector_v = [0.0] * columns + [1.0] * columns
    line = np.linspace(0.0, 1.0, SAMPLES)
    grid = [(u, v) for u in line.tolist() for v in line.tolist()]
    samples = np.array(surface.evaluate_list(grid))

    def run() -> Iterator[float]:
        for x in points:
            u, v = grid[int(((samples - x) ** 2).sum(axis=1).argmin())]
            for _ in range(STEPS):
                s = np.array([each[:3] for each in surface.derivatives(u, v, 2)])
                y = s[0, 0] - x
                f = np.array([y @ s[1, 0], y @ s[0, 1]])
                mixed = s[1, 0] @ s[0, 1] + y @ s[1, 1]
                form = np.array(
                    [
                        [s[1, 0] @ s[1, 0] + y @ s[2, 0], mixed],
                        [mixed, s[0, 1] @ s[0, 1] + y @ s[0, 2]],
                    ]
                )
                step = np.linalg.lstsq(form, -f, rcond=None)[0]
                new = np.clip([u + step[0], v + step[1]], 0.0, 1.0).tolist()
                change = abs(new[0] - u) + abs(new[1] - v)
                u, v = new
                if change < ENOUGH:
                    break
            yield float(np.linalg.norm(np.array(surface.evaluate_single((u, v))) - x))

    return run


def main(name: str) -> None:
    """Processes files until the input ends."""
    peer = {"open_cascade": open_cascade, "splinepy": splinepy, "geomdl": geomdl}[name]
    for line in sys.stdin:
        points = np.load(line.strip())
        runs = [peer(net, points["points"]) for net in points["nets"]]
        start = time.process_time()
        distances = np.min([list(run()) for run in runs], axis=0)
        seconds = time.process_time() - start
        np.savez(f"{line.strip()}.out.npz", distances=distances, seconds=seconds)
        print(flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
