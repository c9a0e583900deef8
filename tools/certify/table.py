"""What was found, family by family."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from statistics import median

from tools.certify.judge import Verdict

HEADER = (
    f"{'family':28}{'meshes':>7}{'triangles':>10}{'found/bound':>12}{'found/tol':>10}"
    f"{'bound/tol':>10}{'spikes':>7}{'bad':>5}{'excused':>8}{'wrong':>6}{'seconds':>8}"
)


def by_resolution(verdicts: Iterable[Verdict]) -> list[str]:
    """How tight the bounds are of meshes that were asked for by resolution."""
    families: dict[str, list[float]] = defaultdict(list)
    for v in verdicts:
        families[v.case.family].append(v.deviation / v.bound if v.bound > 0 else 1.0)
    header = f"{'by resolution':28}{'meshes':>7}{'found/bound: median':>20}{'largest':>9}"
    return [header] + [
        f"{name:28}{len(found):7}{median(found):20.3f}{max(found):9.3f}"
        for name, found in families.items()
    ]


def rows(verdicts: Iterable[Verdict]) -> list[str]:
    """One line a family, and one for all of them."""
    families: dict[str, list[Verdict]] = defaultdict(list)
    for verdict in verdicts:
        families[verdict.case.family].append(verdict)
    lines = [_row(name, found) for name, found in families.items()]
    return [HEADER, *lines, _row("all", [v for found in families.values() for v in found])]


def _row(name: str, found: Sequence[Verdict]) -> str:
    whole = [v for v in found if v.triangles] or found
    tight = max((v.deviation / v.bound for v in whole if v.bound > 1e-12 * v.tolerance), default=0)
    return (
        f"{name:28}{len(found):7}{median(v.triangles for v in whole):10.0f}{tight:12.3f}"
        f"{max(v.deviation / v.tolerance for v in whole):10.3f}"
        f"{max(v.bound / v.tolerance for v in whole):10.3f}"
        f"{sum(v.missed for v in found):7}{sum(v.bad_triangles for v in found):5}"
        f"{sum(v.excused for v in found):8}"
        f"{sum(bool(v.wrong) for v in found):6}{sum(v.seconds for v in found):8.1f}"
    )
