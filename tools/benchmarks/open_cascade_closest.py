"""Open CASCADE's closest points, in a Python of its own: knows nothing of the service.

Reads names of .npz files, one a line, and answers each with a line once the file `<name>.out.npz`
is written. A file holds `nets` (K, n, m, 3) of Bézier patches and `points` (N, 3). The answer holds
`distances` (N,), NaN where nothing was found, and `seconds` of processor time, for all patches.
"""

import sys
import time

import numpy as np
from OCP.collections import Array2_gp_Pnt
from OCP.Geom import Geom_BezierSurface
from OCP.GeomAPI import GeomAPI_ProjectPointOnSurf
from OCP.gp import gp_Pnt

for name in sys.stdin:
    stated = np.load(name.strip())
    surfaces = []
    for net in stated["nets"]:
        rows, columns = net.shape[:2]
        array = Array2_gp_Pnt(1, rows, 1, columns)
        for i in range(rows):
            for j in range(columns):
                array.SetValue(i + 1, j + 1, gp_Pnt(*net[i, j].tolist()))
        surfaces.append(Geom_BezierSurface(array))
    points = [gp_Pnt(*point) for point in stated["points"].tolist()]
    distances = np.full(len(points), np.inf)
    start = time.process_time()
    for surface in surfaces:
        search = GeomAPI_ProjectPointOnSurf()
        search.Init(surface, 0.0, 1.0, 0.0, 1.0, 1e-9)
        for k, point in enumerate(points):
            search.Perform(point)
            if search.NbPoints():
                distances[k] = min(distances[k], search.LowerDistance())
    seconds = time.process_time() - start
    np.savez(f"{name.strip()}.out.npz", distances=distances, seconds=seconds)
    print(flush=True)
