"""Closest points by another library, in a Python of its own, without the service.

    python closest_worker.py open_cascade | splinepy | geomdl

The program reads names of .npz files, one in each line. For each it writes the file
`<name>.out.npz`, and then prints an empty line. An input file has `nets` (K, n, m, 3) of Bézier
patches and `points` (N, 3). An output file has `distances` (N,), ∞ if the library found no closest
point, and `seconds` of CPU time for all patches. The time does not include building the library's
surfaces, nor other preparation that is done once for many points.

Open CASCADE's Extrema searches for normals through the point. splinepy uses Newton's method from
the nearest of a grid of samples: 2 n samples for n control points, its default. geomdl has no
function for closest points: this program uses its derivatives in Newton's method (The NURBS Book,
section 6.1), from the nearest of its samples.
"""

import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

SAMPLES, MAX_STEPS, MIN_CHANGE = 10, 20, 1e-10
"""For geomdl: samples of a patch in each direction, the largest number of steps, and the change of
parameters below which the steps end."""


def prepare_open_cascade(net: Any, points: Any) -> Callable[[], Iterator[float]]:
    """A function that searches with Open CASCADE's GeomAPI_ProjectPointOnSurf."""
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
    query_points = [gp_Pnt(*point) for point in points.tolist()]

    def find_distances() -> Iterator[float]:
        search = GeomAPI_ProjectPointOnSurf()
        search.Init(surface, 0.0, 1.0, 0.0, 1.0, 1e-9)
        for point in query_points:
            search.Perform(point)
            yield search.LowerDistance() if search.NbPoints() else np.inf

    return find_distances


def prepare_splinepy(net: Any, points: Any) -> Callable[[], Iterator[float]]:
    """A function that searches with splinepy's Bezier.proximities."""
    import splinepy  # noqa: PLC0415

    rows, columns = net.shape[:2]
    # In splinepy's order, the index of the first parameter varies fastest.
    surface = splinepy.Bezier([rows - 1, columns - 1], net.transpose(1, 0, 2).reshape(-1, 3))

    def find_distances() -> Iterator[float]:
        proximities = surface.proximities(
            points, [2 * rows, 2 * columns], nthreads=1, return_verbose=True
        )
        distances = proximities[3]  # after parameters, points and differences
        return iter(distances.ravel().tolist())

    return find_distances


def prepare_geomdl(net: Any, points: Any) -> Callable[[], Iterator[float]]:
    """A function that searches by Newton's method with geomdl's derivatives."""
    from geomdl.BSpline import Surface  # noqa: PLC0415

    surface = Surface()
    rows, columns = net.shape[:2]
    surface.degree_u, surface.degree_v = rows - 1, columns - 1
    surface.set_ctrlpts(net.reshape(-1, 3).tolist(), rows, columns)
    surface.knotvector_u = [0.0] * rows + [1.0] * rows
    surface.knotvector_v = [0.0] * columns + [1.0] * columns
    parameters = np.linspace(0.0, 1.0, SAMPLES)
    grid = [(u, v) for u in parameters.tolist() for v in parameters.tolist()]
    samples = np.array(surface.evaluate_list(grid))

    def find_distances() -> Iterator[float]:
        for x in points:
            u, v = grid[int(((samples - x) ** 2).sum(axis=1).argmin())]
            for _ in range(MAX_STEPS):
                # s[k, l] is the derivative of order k in u and l in v; f(u, v) = 0 is to be solved.
                s = np.array([each[:3] for each in surface.derivatives(u, v, 2)])
                y = s[0, 0] - x
                f = np.array([y @ s[1, 0], y @ s[0, 1]])
                mixed = s[1, 0] @ s[0, 1] + y @ s[1, 1]
                matrix = np.array(
                    [
                        [s[1, 0] @ s[1, 0] + y @ s[2, 0], mixed],
                        [mixed, s[0, 1] @ s[0, 1] + y @ s[0, 2]],
                    ]
                )
                step = np.linalg.lstsq(matrix, -f, rcond=None)[0]
                new_parameters = np.clip([u + step[0], v + step[1]], 0.0, 1.0).tolist()
                change = abs(new_parameters[0] - u) + abs(new_parameters[1] - v)
                u, v = new_parameters
                if change < MIN_CHANGE:
                    break
            yield float(np.linalg.norm(np.array(surface.evaluate_single((u, v))) - x))

    return find_distances


def main(name: str) -> None:
    """Computes the distances for each file whose name is read, until the input ends."""
    prepare = {
        "open_cascade": prepare_open_cascade,
        "splinepy": prepare_splinepy,
        "geomdl": prepare_geomdl,
    }[name]
    for line in sys.stdin:
        arrays = np.load(line.strip())
        searches = [prepare(net, arrays["points"]) for net in arrays["nets"]]
        start = time.process_time()
        distances = np.min([list(search()) for search in searches], axis=0)
        seconds = time.process_time() - start
        np.savez(f"{line.strip()}.out.npz", distances=distances, seconds=seconds)
        print(flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
