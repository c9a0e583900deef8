"""The type of findings about a mesh, and tables of findings."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import median


@dataclass(kw_only=True)
class Finding:
    """The findings about one mesh.

    `kind` and `seed` name the surface. `deviation` is the largest sampled distance, and `bound` the
    bound in the file. `faults` lists the faults in words.
    """

    kind: str
    seed: int
    tolerance: float = 1.0
    bound: float = 0.0
    deviation: float = 0.0
    triangles: int = 0
    seconds: float = 0.0
    faults: list[str] = field(default_factory=list)

    def complaints(self) -> list[str]:
        """A line for each fault, with the name of the mesh."""
        return [f"WRONG: {self}: {text}" for text in self.faults]


def write_rows(title: str, findings: Sequence[Finding], counts: Sequence[str] = ()) -> list[str]:
    """The lines of a table: a header, a row for each kind, and a row for all.

    `counts` are names of attributes whose sums are further columns.
    """
    header = (
        f"{title:28}{'meshes':>7}{'triangles':>10}{'found/bound':>12}{'median':>8}{'found/tol':>10}"
        f"{'bound/tol':>10}{''.join(f'{name:>9}' for name in counts)}{'wrong':>6}{'seconds':>8}"
    )
    kinds: dict[str, list[Finding]] = {}
    for each in findings:
        kinds.setdefault(each.kind, []).append(each)
    lines = [_write_row(kind, cases, counts) for kind, cases in kinds.items()]
    return [header, *lines, _write_row("all", findings, counts)]


def _write_row(name: str, findings: Sequence[Finding], counts: Sequence[str]) -> str:
    """One row of a table.

    `found` in its header is the sampled deviation: columns have the largest and the median ratio of
    it to the bound, and the largest ratios of it and of the bound to the tolerance.
    """
    with_triangles = [each for each in findings if each.triangles] or findings
    # The bound of a flat surface is only rounding, and would give a meaningless ratio.
    with_bound = [each for each in with_triangles if each.bound > 1e-12 * each.tolerance]
    ratios = [each.deviation / each.bound for each in with_bound] or [0.0]
    sums = (sum(getattr(each, count) for each in findings) for count in counts)
    return (
        f"{name:28}{len(findings):7}{median(each.triangles for each in with_triangles):10.0f}"
        f"{max(ratios):12.3f}{median(ratios):8.3f}"
        f"{max(each.deviation / each.tolerance for each in with_triangles):10.3f}"
        f"{max(each.bound / each.tolerance for each in with_triangles):10.3f}"
        f"{''.join(f'{total:9}' for total in sums)}"
        f"{sum(bool(each.faults) for each in findings):6}"
        f"{sum(each.seconds for each in findings):8.1f}"
    )
