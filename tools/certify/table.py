"""Findings about each mesh, and tables of them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import median


@dataclass(kw_only=True)
class Finding:
    """The findings about one mesh; `wrong` lists the faults."""

    kind: str
    seed: int
    tolerance: float = 1.0
    bound: float = 0.0
    deviation: float = 0.0
    triangles: int = 0
    seconds: float = 0.0
    wrong: list[str] = field(default_factory=list)

    def complaints(self) -> list[str]:
        """The mesh's name and its faults."""
        return [f"WRONG: {self}: {text}" for text in self.wrong]


def write_rows(title: str, findings: Sequence[Finding], counts: Sequence[str] = ()) -> list[str]:
    """A header, a line for each kind, and a line for all; `counts` are attributes to add up."""
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
    meshed = [each for each in findings if each.triangles] or findings
    proved = [each for each in meshed if each.bound > 1e-12 * each.tolerance]
    tight = [each.deviation / each.bound for each in proved] or [0.0]
    sums = (sum(getattr(each, count) for each in findings) for count in counts)
    return (
        f"{name:28}{len(findings):7}{median(each.triangles for each in meshed):10.0f}"
        f"{max(tight):12.3f}{median(tight):8.3f}"
        f"{max(each.deviation / each.tolerance for each in meshed):10.3f}"
        f"{max(each.bound / each.tolerance for each in meshed):10.3f}"
        f"{''.join(f'{total:9}' for total in sums)}"
        f"{sum(bool(each.wrong) for each in findings):6}"
        f"{sum(each.seconds for each in findings):8.1f}"
    )
