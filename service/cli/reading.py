"""The report of reading a CAD file, in plain words on standard error: no loss is silent."""

from collections.abc import Iterator, Mapping
from typing import Any

from service.cli.refusals import print_error
from service.errors import count_nouns

MAX_LISTED = 20
"""The most faces, and the most kinds of entities, that are printed one by one."""

SMALL_GAP = 1e-9
"""Gaps up to the uncertainty of a file, or up to this if it states none, are not printed."""

_COUNTS = ("products", "solids", "open_shells", "faces")


def print_reading(name: str, reading: Mapping[str, Any] | None) -> None:
    """Prints a report of reading; `name` is that of the file. Without a report, prints nothing."""
    for line in _describe(reading) if reading else ():
        print_error(f"{name}: {line}")


def print_counts(name: str, header: str) -> None:
    """Prints the counts in the header `Surface-Reading` of a response."""
    counts = dict(part.strip().partition("=")[::2] for part in header.split(";"))
    read, skipped = (counts.get(key, "") for key in ("faces", "skipped"))
    if read.isdecimal() and skipped.isdecimal():
        print_error(f"{name}: {count_nouns(int(read), 'faces')}{_say_skipped(int(skipped))}")


def _say_skipped(count: int) -> str:
    if not count:
        return ""
    return f"; {_are(count, 'faces')} not in the surface, and `surface convert` says which and why"


def _are(count: int, nouns: str) -> str:
    return f"{count_nouns(count, nouns)} {'is' if count == 1 else 'are'}"


def _describe(reading: Mapping[str, Any]) -> Iterator[str]:
    about = [reading["format"].upper()]
    if schema := reading.get("schema"):
        if schema.startswith(f"{about[0]} "):  # IGES 5.3
            about.clear()
        about.append(schema)
    if system := reading.get("system"):
        about.append(f"written by {system}")
    if units := reading.get("units"):
        about.append(f"in {', '.join(units)}")
    counts = [
        count_nouns(reading[name], name.replace("_", " "))
        for name in _COUNTS
        if reading.get(name) or name == "faces"
    ]
    yield f"{', '.join(about)}: {', '.join(counts)}"
    if skipped := reading.get("skipped_faces"):
        yield f"{_are(len(skipped), 'faces')} not in the surface:"
        for face in skipped[:MAX_LISTED]:
            yield f"  {face['entity']}: {face['reason']}"
        if len(skipped) > MAX_LISTED:
            yield f"  and {len(skipped) - MAX_LISTED} more, which `surface convert` lists"
    if entities := reading.get("skipped_entities"):
        listed = [f"{count} {keyword}" for keyword, count in [*entities.items()][:MAX_LISTED]]
        rest = len(entities) - len(listed)
        yield f"not read: {', '.join(listed)}{f', and {rest} other kinds' if rest else ''}"
    if names := reading.get("changed_names"):
        yield f"{count_nouns(names, 'names')} shortened or cleaned"
    if references := reading.get("unfollowed_references"):
        yield f"{count_nouns(references, 'references')} to other files not followed"
    if edges := reading.get("open_edges"):
        yield f"{count_nouns(edges, 'edges')} of only one face"
    edge, vertex = reading.get("edge_gap") or 0.0, reading.get("vertex_gap") or 0.0
    if max(edge, vertex) > (reading.get("uncertainty") or SMALL_GAP):
        yield f"largest gaps: {edge:.3g} from edge to surface, {vertex:.3g} from vertex to edge"
