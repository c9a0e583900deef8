"""How far a given mesh and a surface are apart, as two intervals, by finer and finer references.

Let S be the surface, M the mesh, and R a reference mesh of S: no point of S is further than a from
R, no point of R further than b from S. For the largest distance D(A, B) from a point of A to B,

    D(R, M) − b ≤ D(S, M) ≤ D(R, M) + a,   D(M, R) − a ≤ D(M, S) ≤ D(M, R) + b.

The first reference mesh is coarse; each distance says how fine the next must be. The lower ends are
also distances of single points, from the search for closest points.

Proof in docs/proofs.md: "Distances from anyone's mesh".
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf, pi
from typing import Literal, Protocol, TypeAlias

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.mesh_checks.faults import find_flat
from service.engine.mesh_checks.reference import ReferenceMesh
from service.engine.mesh_distances.nearest import NearestTriangles, find_nearest
from service.engine.mesh_distances.search import bound_largest_distance
from service.engine.mesh_distances.tree import TriangleTree
from service.engine.vectors import NEXT, cross, dot, length, normalize
from service.surface.given_mesh import GivenMesh

Limit: TypeAlias = Literal["work", "rounding", "thin"]
"""What keeps an interval from being narrower: the limits of work, rounding, or that no better bound
from the mesh to a part was proved."""

FIRST, FLOOR, LARGEST_STEP, ROUNDS = 0.01, 1e-9, 32.0, 8
"""Shares of the diagonal: the tolerance of the first reference mesh, and the width of intervals that
is narrow in any case. No tolerance is less than 1/`LARGEST_STEP` of the one before, and there are
at most `ROUNDS`."""

REFERENCE_SHARE, SEARCH_SHARE = 0.3, 0.25
"""Shares of the allowed width: the tolerance of the reference mesh (its second bound is up to twice
as large), and the width of the interval between the two meshes."""
