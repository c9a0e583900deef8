"""Proves the bounds of meshes over HTTP, for surfaces of every family and examples: `make judge`.

    python -m tools.judge [share] [family …]

`share` is the share of the surfaces that is judged, 1 for all: 200 of every family. The solids of
`oracles.solids` are one family, `solids`, whose shells must also be closed. The exit status is 1
if a point was found beyond a bound, if a file could not be judged, or if a case stayed undecided.
"""

import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import chain
from multiprocessing import Pool, cpu_count
from typing import Any, NamedTuple

import numpy as np

from oracles.breps import count_cracks
from oracles.solids import VALID, read_solid
from service.api.app import create_app
from service.settings.runtime import pin_blas
from service.settings.values import Settings
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.examples.catalogue import EXAMPLES
from tools.certify.surfaces import FAMILIES, Surface
from tools.client import Client, start_client
from tools.judge.breps import prove_brep
from tools.judge.exact import list_nets, read_glb, read_stl
from tools.judge.proof import Proof, prove

OF_EACH, FIRST = 200, 5000
"""Number of surfaces of every family, and the seed of the first; `make certify` uses other
seeds."""

TOGETHER = 20
"""Cases that one process judges before it returns their verdicts."""

OPTIONS: tuple[dict[str, Any], ...] = (
    {"relative_tolerance": 1e-4}, {"relative_tolerance": 1e-2}, {"relative_tolerance": 1e-2},
    {"relative_tolerance": 1e-3}, {"relative_tolerance": 1e-2}, {"resolution": [5, 7]},
    {"relative_tolerance": 1e-3}, {"relative_tolerance": 1e-2}, {"relative_tolerance": 1e-2},
    {"relative_tolerance": 1e-3},
)  # fmt: skip
"""Options of requests, in turn. Only one in ten has the smallest tolerance, because its files have
most of the triangles."""

WITHOUT_PATCHES = {"tube", "ribbon", "group"}
"""Kinds of surfaces whose documents have no patches that `list_nets` could read."""

PROCESSES = min(2, cpu_count())
"""Number of processes that judge cases at the same time."""


SOLID_TOLERANCES = 1e-2, 1e-3
"""Relative tolerances of the meshes of solids."""


SOLID = "solid "
"""The names of families of solids begin with this."""


class Case(NamedTuple):
    """A mesh of one surface of a family; without a seed, of an example or of a solid."""

    family: str
    seed: int | None
    options: dict[str, Any]
    suffix: str


class Verdict(NamedTuple):
    """The number of triangles of a mesh, the bound that the service reported, and its proof.

    `seconds` is the CPU time of the proof.
    """

    case: Case
    triangles: int
    bound: float
    proof: Proof
    seconds: float


def list_cases(share: float = 1.0, names: tuple[str, ...] = ()) -> Iterator[Case]:
    """Surfaces of every family with all options in turn, and the examples; half of them as STL.

    `names` selects families; `examples` is one of the names. Families of lines are left out:
    without areas of triangles, the proof would need pieces as small as the bound.
    """
    for number, name in enumerate(name for name, each in FAMILIES.items() if not each.has_no_area):
        for k in range(max(1, round(OF_EACH * share)) if not names or name in names else 0):
            options = OPTIONS[(k + number) % len(OPTIONS)]
            yield Case(name, FIRST + k, options, ("glb", "stl")[(k + number) // 2 % 2])
    for number, name in enumerate(EXAMPLES if not names or "examples" in names else ()):
        yield Case(name, None, OPTIONS[number % len(OPTIONS)], ("stl", "glb")[number % 2])
    for name in VALID if not names or "solids" in names else ():
        for relative in SOLID_TOLERANCES:
            yield Case(SOLID + name, None, {"relative_tolerance": relative}, "glb")


def write_document(surface: Surface) -> dict[str, Any]:
    """The JSON document of a surface, as a client writes it."""
    net: Any = surface.control_net.tolist()
    weights: Any = None if surface.weights is None else surface.weights.tolist()
    document: dict[str, Any] = {"type": "bezier"}
    if isinstance(surface, BsplineSurface):
        knots = [k if isinstance(k, str) else k.tolist() for k in surface.knots]
        document = {"type": "bspline", "degree": surface.degree, "knots": knots}
    elif not isinstance(surface, BezierSurface):
        document = {"type": "triangle"}
        net = split_rows(net)
        weights = weights and split_rows(weights)
    return document | {"control_net": net} | ({"weights": weights} if weights else {})


def split_rows(points: list[Any]) -> list[list[Any]]:
    """The items of a list as rows of n + 1, n, … 1."""
    rows, rest = [], points
    while rest:
        count = int((2 * len(rest)) ** 0.5)
        rows.append(rest[:count])
        rest = rest[count:]
    return rows


def judge(client: Client, case: Case) -> Verdict | None:
    """Requests the mesh and proves its bound.

    None if the surface has no patches, or if the service refuses the tolerance as too small.
    """
    if case.family.startswith(SOLID):
        return judge_solid(client, case)
    if case.seed is None:
        surface = client.get(f"/v1/surfaces/{case.family}").json()["surface"]
        surface["up"] = "y"  # so that glTF does not turn the surface
    else:
        surface = write_document(FAMILIES[case.family].surface(case.seed))
    if surface.get("type") in WITHOUT_PATCHES:
        return None
    request = {"surface": surface, "normals": False, **case.options}
    response = client.post(f"/v1/mesh?format={case.suffix}", request)
    if response.status_code == 422 and "tolerance_too_small" in response.text:
        return None
    assert response.status_code == 200, f"{case}: {response.text}"
    # The corners are relative to the origin: that of the GLB, or zero.
    corners, origin = {"glb": read_glb, "stl": read_stl}[case.suffix](response.content)
    bound = float(response.headers["surface-deviation-bound"])
    start = time.process_time()
    proof = prove(list_nets(surface, origin), corners, bound)
    return Verdict(case, len(corners), bound, proof, time.process_time() - start)


def judge_solid(client: Client, case: Case) -> Verdict:
    """Requests the mesh of a solid, counts its cracks, and proves its bound."""
    surface = read_solid(case.family.removeprefix(SOLID)) | {
        "up": "y"
    }  # so that glTF does not turn the solid
    request = {"surface": surface, "normals": False, **case.options}
    response = client.post(f"/v1/mesh?format={case.suffix}", request)
    assert response.status_code == 200, f"{case}: {response.text}"
    corners, origin = read_glb(response.content)
    cracks = count_cracks(corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(-1, 3))
    assert not cracks, f"{case}: {len(cracks)} edges without their reverse"
    bound = float(response.headers["surface-deviation-bound"])
    start = time.process_time()
    tolerance = case.options["relative_tolerance"] * float(
        np.linalg.norm(np.ptp(corners, axis=(0, 1)))
    )
    result = prove_brep(surface, corners, origin, bound, tolerance)
    proof = Proof(result.pieces, result.exact, result.undecided, result.beyond)
    return Verdict(case, len(corners), bound, proof, time.process_time() - start)


def judge_cases(cases: Sequence[Case]) -> list[Verdict | str]:
    """Verdicts of some cases; a text for a case that could not be judged.

    If the service refuses the STL of a case because float32 is too coarse for the tolerance, the
    GLB is judged: its coordinates are relative to an origin near the surface.
    """
    verdicts: list[Verdict | str] = []
    with start_client(create_app(Settings())) as client:
        for case in cases:
            try:
                verdict = judge(client, case) or judge(client, case._replace(suffix="glb"))
            except Exception as error:
                verdicts.append(f"{case}: {error!r}")
            else:
                verdicts += [verdict] if verdict else []
    return verdicts


def main(arguments: list[str]) -> int:
    """Judges all cases; prints a row for each family, and each case that is not proved."""
    share = float(arguments[0]) if arguments else 1.0
    totals: dict[str, Counter[str]] = {}
    lines, failed = [], False
    cases = list(list_cases(share, tuple(arguments[1:])))
    groups = [cases[k : k + TOGETHER] for k in range(0, len(cases), TOGETHER)]
    with Pool(PROCESSES, pin_blas) as pool:
        for verdict in chain.from_iterable(pool.imap_unordered(judge_cases, groups)):
            if isinstance(verdict, str):
                lines.append(verdict)
                failed = True
                continue
            case, proof = verdict.case, verdict.proof
            counts = Counter(
                surfaces=1, triangles=verdict.triangles, pieces=proof.pieces, exact=proof.exact,
                violations=int(proof.beyond is not None), undecided=proof.undecided,
                milliseconds=round(1e3 * verdict.seconds),
            )  # fmt: skip
            name = "examples" if case.seed is None else case.family
            name = "solids" if case.family.startswith(SOLID) else name
            for row in (name, "all"):
                totals.setdefault(row, Counter()).update(counts)
            if totals["all"]["surfaces"] % 100 == 0:
                print(f"{name}: {dict(totals['all'])}", file=sys.stderr, flush=True)
            if proof.undecided or proof.beyond is not None:
                lines.append(f"{case}: bound {verdict.bound}, {proof}")
                failed = True
    columns = (
        "surfaces", "triangles", "pieces", "exact", "violations", "undecided", "milliseconds"
    )  # fmt: skip
    print(f"{'family':28}" + "".join(f"{name:>13}" for name in columns))
    for row in sorted(totals, key=[*FAMILIES, "examples", "solids", "all"].index):
        print(f"{row:28}" + "".join(f"{totals[row][name]:13}" for name in columns))
    print("\n".join([*lines, "Something is wrong." if failed else "Nothing is wrong."]))
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
