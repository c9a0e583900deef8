"""`surface check` compares a mesh with its surface: a summary for people, or JSON for programs."""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from service.cli.documents import Document, compute_document, post_document, query_texts
from service.cli.files import FILE_FLAGS, SourceFile, read_field_flags
from service.cli.flags import Command, flag, parse_number, read_values
from service.cli.output import check_output, obtain, output_flags, print_lines, write
from service.cli.refusals import OK, Refused, UsageError
from service.cli.source import (
    build_document,
    field_line,
    find_stored_id,
    read_source,
    source_flag,
    surface_source,
)
from service.errors import count_nouns

if TYPE_CHECKING:
    from service.decoders.format import Decoder

PATH = "/v1/check"

FAULTS: Mapping[str, str] = {
    "open_edges": "open edges",
    "non_manifold_edges": "non-manifold edges",
    "flipped_edges": "flipped edges",
    "degenerate_faces": "degenerate faces",
}
"""The fields of an answer that count faults of the mesh itself, and their nouns."""

LIMITS: Mapping[str, str] = {
    "work": "they would take more work than one request may take",
    "rounding": "rounding is as large as the deviation",
    "thin": "the surface has a part that is too thin",
}
"""Why intervals are wider than `--relative-tolerance` says, by the field `limit` of an answer."""

_OPTIONS = (
    flag("--relative-tolerance", "largest width of an interval (0.1)", "SHARE", type=parse_number),
    flag("--quad-diagonal", "how faces of four corners are divided: 02 (default) or 13", "CORNERS"),
    flag(
        "--distances",
        "write the distance of every vertex, too",
        action="store_const",
        const=True,
    ),
)

_OUTPUT, _URL = output_flags(formats=False)
_OUTPUT = flag(" ".join(_OUTPUT.names), "JSON file to write, or - for standard output")


class MeshFile(NamedTuple):
    """A file with a mesh: its bytes, and its decoder, or None for JSON."""

    content: bytes
    decoder: "Decoder | None"

    def to_document(self) -> Any:
        """The mesh as a request has it."""
        from base64 import b64encode

        from service.schemas.document import parse_document

        if self.decoder is None:
            return parse_document(self.content)
        return {"file": b64encode(self.content).decode(), "format": self.decoder.name}


def _run(arguments: argparse.Namespace) -> int:
    if arguments.output is not None:
        check_output(arguments)
    limit = _read_limit(arguments.max)
    options = read_values(arguments, _OPTIONS)
    mesh = _read_mesh(arguments)
    source = find_stored_id(arguments) or surface_source(arguments)
    fields = options.keys() | read_field_flags(arguments).keys()
    content = obtain(
        arguments,
        lambda: compute_document(PATH, _build(source, mesh, options)),
        lambda: _request(arguments.url, source, mesh, options),
        lambda issue: field_line(issue, fields),
    )
    answer = _parse(content)
    if arguments.output is None:
        print_lines(_summarize(answer))
    else:
        write(arguments.output, content)
    _compare(answer, limit)
    return OK


def _read_limit(value: object) -> float | None:
    if value is not None and not (isinstance(value, int | float) and value >= 0):
        raise UsageError("--max: needed a distance in the units of the surface")
    return value


def _read_mesh(arguments: argparse.Namespace) -> MeshFile:
    """The file of the mesh; its format by `--mesh-format`, by its suffix or by its content."""
    from service.decoders.mesh_registry import MESH_BY_NAME, MESH_BY_SUFFIX, find_mesh_by_content

    if arguments.mesh == arguments.source == "-":
        raise UsageError("standard input has one file: the surface or the mesh")
    names = ", ".join(("json", *MESH_BY_NAME))
    name, suffix = arguments.mesh_format, Path(arguments.mesh).suffix.removeprefix(".").lower()
    if name not in (None, "json", *MESH_BY_NAME):
        raise UsageError(f"--mesh-format: unknown; needed one of {names}")
    content = read_source(arguments.mesh, "mesh", f"{arguments.mesh}: no such file")
    if name == "json" or (name is None and suffix == "json"):
        return MeshFile(content, None)
    if name is not None:
        return MeshFile(content, MESH_BY_NAME[name])
    decoder = MESH_BY_SUFFIX.get(suffix) or find_mesh_by_content(content)
    if decoder is None:
        raise UsageError(f"the format of the mesh is not known; needed --mesh-format {names}")
    return MeshFile(content, decoder)


def _build(
    source: str | Document | SourceFile, mesh: MeshFile, options: Document
) -> dict[str, Any]:
    """The request: the surface, with fields that its file has beside it, the mesh and options."""
    return build_document(source) | {"mesh": mesh.to_document()} | options


def _request(
    url: str, source: str | Document | SourceFile, mesh: MeshFile, options: Document
) -> bytes:
    """The answer of the service at `url`; the file of a mesh is sent as it is, if it can be."""
    from service.cli.remote import post
    from service.schemas.brep_writing import list_columns

    if isinstance(source, str) and mesh.decoder is not None:
        query = {"surface": source} | query_texts(options)
        return post(url, PATH, mesh.content, query=query, media_type=mesh.decoder.media_type)
    document = _build(source, mesh, options)
    if isinstance(source, SourceFile):
        document["surface"] = list_columns(document["surface"])
    return post_document(url, PATH, document)


def _parse(content: bytes) -> dict[str, Any]:
    import orjson

    answer: dict[str, Any] = orjson.loads(content)
    return answer


def _summarize(answer: Mapping[str, Any]) -> Iterator[str]:
    """The answer in plain lines."""
    yield ", ".join(count_nouns(answer[name], name) for name in ("triangles", "vertices"))
    for name in ("surface_to_mesh", "mesh_to_surface"):
        yield f"{name.replace('_', ' ')}: {_describe(answer[name])}"
    yield ", ".join(count_nouns(answer[name], nouns) for name, nouns in FAULTS.items())
    if "max_normal_angle" in answer:
        yield f"largest angle between normals: {degrees(answer['max_normal_angle']):.3g}°"
    if not answer["reached"]:
        reason = LIMITS.get(answer.get("limit", ""), "")
        yield f"the intervals are wider than asked for{': ' * bool(reason)}{reason}"


def _describe(deviation: Mapping[str, Any]) -> str:
    """An interval, and where its lower end is."""
    facts = [
        f"{deviation['low']:.6g} to {deviation['high']:.6g}",
        f"at ({_join(deviation['point'])})",
        f"triangle {deviation['triangle']}",
    ]
    if "patch" in deviation:
        facts.append(f"patch {deviation['patch']}")
    if "uv" in deviation:
        facts.append(f"uv ({_join(deviation['uv'])})")
    return ", ".join(facts)


def _join(numbers: Sequence[float]) -> str:
    return ", ".join(f"{number:.6g}" for number in numbers)


def _compare(answer: Mapping[str, Any], limit: float | None) -> None:
    """Raises `Refused` if a distance may be larger than `--max`."""
    high = max(answer[name]["high"] for name in ("surface_to_mesh", "mesh_to_surface"))
    if limit is not None and high > limit:
        raise Refused(f"the deviation may be {high:.6g}, which is more than --max {limit:g}")


CHECK = Command(
    "check",
    "compare any mesh with its surface, with proofs",
    _run,
    (
        source_flag("options"),
        flag(
            "mesh",
            "a mesh in the coordinates of the surface: .glb, .gltf, .obj, .ply, .stl, .off, JSON "
            "with vertices and faces, or - for standard input",
            "MESH",
        ),
        _OUTPUT,
        _URL,
        flag("--mesh-format", "json, glb, gltf, obj, ply, stl or off; default: by suffix", "NAME"),
        flag(
            "--max",
            "exit with 1 if the mesh may be further than this from the surface, or the surface "
            "from the mesh",
            "DISTANCE",
            type=parse_number,
        ),
    ),
    groups=(("intervals", _OPTIONS), FILE_FLAGS),
    description="Compare a mesh of any program with its surface. Without --output, prints a "
    "summary: the two intervals are proved.",
    has_exit_codes=True,
)
