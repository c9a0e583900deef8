"""Writes the rows as tables of Markdown: a summary of makers, and a line for each surface."""

from collections.abc import Iterator, Sequence
from math import isinf
from statistics import geometric_mean, median

from tools.judge_peers.rows import Row
from tools.judge_peers.running import MAKERS

OURS = "Surface Service"
"""The name of the service among the makers."""

PROMISE = "the tolerance from the surface to the mesh, and twice the tolerance back; proved"

GROUPS = {"examples": "Built-in surfaces", "families": "Random surfaces", "parts": "Parts"}
"""Titles of the groups of surfaces."""


def write_section(rows: Sequence[Row], versions: dict[str, str]) -> str:
    """The whole section."""
    tolerances = sorted({row.relative for row in rows}, reverse=True)
    lines = ["## Mesh makers compared", "", *_write_introduction(rows, tolerances)]
    lines += ["", *write_makers(versions), ""]
    for relative in tolerances:
        title = f"### Tolerance {relative:g} of the diagonal"
        lines += [title, "", *write_summary(rows, relative), ""]
    finest = tolerances[-1]
    for group, title in GROUPS.items():
        chosen = [row for row in rows if row.group == group and row.relative == finest]
        if chosen:
            lines += [f"### {title}, at {finest:g}", "", *write_surfaces(chosen), ""]
    return "\n".join(lines)


def _write_introduction(rows: Sequence[Row], tolerances: Sequence[float]) -> list[str]:
    count = len({row.case for row in rows})
    listed = " and ".join(f"{each:g}" for each in tolerances)
    return [
        f"Each maker got the same {count} surfaces with the same request: a tolerance of {listed}",
        "of the diagonal. Each mesh was judged as `POST /v1/check` does. The makers that read CAD",
        "files got STEP files: of the built-in and random surfaces those that the service writes,",
        "of the parts those of Open CASCADE. The others got control nets; surfaces with trimmed",
        "faces, triangular patches or placed members have no such nets. Tubes and ribbons cannot",
        "be written as STEP.",
        "",
        "`make judge-peers` makes all meshes again and prints this section; with `RELATIVE=1e-3`",
        "for a tenth of the tolerance. Distances and counts are the same on every machine, as far",
        "as the makers are deterministic. Times are those of meshing alone, and of the service",
        "from the parsed request to the file.",
    ]


def write_makers(versions: dict[str, str]) -> list[str]:
    """A line for each maker: its version, its request, and the promise of its documentation."""
    service = versions[OURS]
    lines = [
        "| maker | version | what was asked | what it promises |",
        "| --- | --- | --- | --- |",
        f"| {OURS} | {service} | `tolerance`, `two_sided` | {PROMISE} |",
    ]
    for maker in MAKERS:
        if maker.name in versions:
            version = versions[maker.name]
            lines.append(f"| {maker.name} | {version} | {maker.asked} | {maker.promise} |")
    return lines


def write_summary(rows: Sequence[Row], relative: float) -> list[str]:
    """A line for each maker, over all surfaces."""
    chosen = [row for row in rows if row.relative == relative]
    ours = {row.case: row for row in chosen if row.maker == OURS and row.is_made}
    lines = [
        "| maker | meshes | no mesh | surface → mesh: median, largest | over "
        "| mesh → surface: median, largest | torn | flipped | triangles | time |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for maker in dict.fromkeys(row.maker for row in chosen):
        own = [row for row in chosen if row.maker == maker]
        made = [row for row in own if row.is_made]
        if not made:
            lines.append(f"| {maker} | 0 | {len(own)} |" + " |" * 7)
            continue
        pairs = [(row, ours[row.case]) for row in made if row.case in ours]
        closed = sum(row.is_closed for row in made)
        cells = [
            f"{len(made)}",
            f"{len(own) - len(made)}",
            _write_range([row.to_mesh[1] for row in made]),
            f"{sum(row.is_over for row in made)}",
            _write_range([row.to_surface[1] for row in made]),
            f"{sum(row.is_torn for row in made)} of {closed}",
            f"{sum(row.flipped > 0 for row in made)}",
            "× " + format_number(geometric_mean(a.triangles / b.triangles for a, b in pairs)),
            "× " + format_number(geometric_mean(_compare_times(pairs))),
        ]
        lines.append(f"| {maker} | {' | '.join(cells)} |")
    return [
        *lines,
        "",
        "Distances are upper ends of intervals, divided by the tolerance. *Over* counts meshes",
        "with a point of the surface that is certainly further away than the tolerance; *torn*",
        "counts meshes of closed surfaces with edges of one triangle, or of more than two;",
        "*flipped* those with neighbours of opposite winding. Triangles and times are",
        "geometric means of the ratios to ours.",
    ]


def _write_range(values: Sequence[float]) -> str:
    return f"{format_number(median(values))}, {format_number(max(values))}"


def _compare_times(pairs: Sequence[tuple[Row, Row]]) -> Iterator[float]:
    for row, own in pairs:
        yield max(row.seconds, 1e-4) / max(own.seconds, 1e-4)


def write_surfaces(rows: Sequence[Row]) -> list[str]:
    """A line for each surface, with a cell for each maker."""
    makers = list(dict.fromkeys(row.maker for row in rows))
    lines = [
        f"| surface | {' | '.join(makers)} |",
        "| --- " * (len(makers) + 1) + "|",
    ]
    for case in dict.fromkeys(row.case for row in rows):
        cells = [
            next((write_cell(r) for r in rows if (r.case, r.maker) == (case, maker)), "–")
            for maker in makers
        ]
        lines.append(f"| {case} | {' | '.join(cells)} |")
    return [
        *lines,
        "",
        "Each cell has the larger of both distances, divided by the tolerance, and the number of",
        "triangles; *torn* is followed by the number of edges at which the mesh of a closed",
        "surface is not closed.",
    ]


def write_cell(row: Row) -> str:
    """The cell of one mesh."""
    if not row.is_made:
        return f"none: {row.error.splitlines()[0][:60].replace('|', '/')}"
    text = f"{format_number(max(row.to_mesh[1], row.to_surface[1]))} ({row.triangles})"
    return f"{text}, torn {row.open_edges}" if row.is_torn else text


def format_number(value: float) -> str:
    """A number with two digits, or all digits before the point."""
    if isinf(value):
        return "∞"
    return f"{value:.0f}" if value >= 9.95 else f"{value:.2g}"
