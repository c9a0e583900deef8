"""`surface convert`: writes a surface, or a part of it, in another form with the same points.

The output is JSON, or STEP, IGES or VTU by its suffix.

A malformed number in a flag stays a string, which the model of the request then refuses.
"""

import argparse
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from typing import Any

from service.cli.documents import Document, Query
from service.cli.files import read_field_flags
from service.cli.flags import Flag, flag
from service.cli.refusals import issue_line
from service.cli.source import field_line, source_flag
from service.errors import InvalidRequest, Issue, MalformedJson


def _name_text(name: str, text: str) -> tuple[str, str]:
    return name, text


def _operation_flag(name: str, metavar: str | None, text: str) -> Flag:
    """The flag of an operation; its name and its text are appended to a list, in their order."""
    how: dict[str, Any] = {"action": "append", "type": partial(_name_text, name)}
    if metavar is None:
        how = {"action": "append_const", "const": _name_text(name, "")}
    return flag(f"--{name}", text, metavar, dest="operations", **how)


def _merge_operations(document: Document, values: Document) -> Document:
    """Flags of operations replace the operations in the file."""
    if "operations" in values:
        _, values["operations"] = operations_from_text(values["operations"])
    return document


def _operation_line(issue: Issue, arguments: argparse.Namespace) -> str:
    """An issue as a line that names the flag of the operation that has the error."""
    flags, _ = operations_from_text(arguments.operations or ())
    # "/operations/2/…" is split into "", "operations", "2", …; a shorter pointer is filled with "".
    _, field, number = (*issue.pointer.split("/"), "", "")[:3]
    if field == "operations" and not number and len(flags) == 1:
        number = "0"  # a service that has got a file names the parameter alone
    if field == "operations" and number.isdecimal() and int(number) < len(flags):
        return issue_line(replace(issue, pointer=f"/{flags[int(number)]}"), flags)
    return field_line(issue, read_field_flags(arguments))


CONVERT = Query(
    "convert",
    "write a surface, or a part of it, in another form with the same points, or as a CAD file",
    "/v1/convert",
    source_flag("operations"),
    "operations, applied in the order of the flags",
    (
        _operation_flag("elevate", "P,Q|N", "raise the degree"),
        _operation_flag(
            "split", "u=A,v=B|R,S,T", "cut at u, at v or at both; a triangle at a point"
        ),
        _operation_flag("restrict", "u=A:B,v=C:D", "cut out a piece"),
        _operation_flag("insert", "u=A,v=B", "insert a knot into a B-spline"),
        _operation_flag("transpose", None, "exchange u and v"),
        _operation_flag("reverse", "u|v", "reverse u or v"),
        _operation_flag("bezier", None, "convert a B-spline to Bézier patches"),
        _operation_flag("triangle", "lower|upper", "make a triangular patch of half a patch"),
        _operation_flag("patch", "K", "change only this patch, by the operation before this flag"),
        _operation_flag("untrim", "[M:]FACE", "take the whole surface of a face of a brep"),
        _operation_flag(
            "select", "[M:]FACE,FACE", "take some faces of a brep; of a group, member M"
        ),
        _operation_flag(
            "orient", None, "turn patches so that neighbours agree and volumes are positive"
        ),
        _operation_flag("operations", "JSON", "a list of operations, as in a request"),
    ),
    _merge_operations,
    has_formats=True,
    default_format="json",
    line=_operation_line,
    reads_files=True,
)


def operations_from_text(arguments: Iterable[tuple[str, str]]) -> tuple[list[str], list[Any]]:
    """The flag of each operation, and the operations as a JSON body has them.

    Parameters
    ----------
    arguments : iterable of (str, str)
        The name of each flag, and its text.

    Raises
    ------
    InvalidRequest
        A text is not a JSON list, or a name is repeated.
    """
    flags: list[str] = []
    operations: list[Any] = []
    for name, text in arguments:
        if name == "patch":
            _choose_patch(operations, text)
            continue
        parsed = _parse_list(text) if name == "operations" else [_parse_operation(name, text)]
        operations += parsed
        flags += [name] * len(parsed)
    return flags, operations


def _choose_patch(operations: list[Any], text: str) -> None:
    """Limit the last operation to a patch; a malformed number stays a string."""
    from service.schemas.query import number_from_text

    if not operations or not isinstance(operations[-1], dict):
        texts = "A patch belongs to an operation.", "--patch", "no operation before it"
        raise InvalidRequest(Issue("missing_field", *texts, "an operation, then --patch"))
    operations[-1]["patch"] = number_from_text(text)


def _parse_operation(name: str, text: str) -> dict[str, object]:
    from service.schemas.query import number_from_text

    fields: dict[str, object] = {}
    match name:
        case "elevate":
            fields = {"degree": _one_or_list(_parse_numbers(text, ","))}
        case "split" | "insert" if "=" in text or name == "insert":
            fields = {key: number_from_text(value) for key, value in _parse_pairs(name, text)}
        case "split":
            fields = {"at": _parse_numbers(text, ",")}
        case "restrict":
            fields = {key: _parse_numbers(value, ":") for key, value in _parse_pairs(name, text)}
        case "reverse":
            fields = {"direction": text}
        case "triangle":
            fields = {"half": text}
        case "untrim" | "select":
            member, colon, faces = text.rpartition(":")
            numbers = _parse_numbers(faces, ",")
            fields = {"faces": numbers} if name == "select" else {"face": _one_or_list(numbers)}
            if colon:
                fields["member"] = number_from_text(member)
    return {"op": name} | fields


def _parse_numbers(text: str, separator: str) -> list[int | float | str]:
    from service.schemas.query import number_from_text

    return [number_from_text(part) for part in text.split(separator)]


def _one_or_list(numbers: list[int | float | str]) -> object:
    """The only number of a list, or the list."""
    return numbers[0] if len(numbers) == 1 else numbers


def _parse_pairs(flag: str, text: str) -> list[tuple[str, str]]:
    """Names and values of "u=…,v=…"; refuses a repeated name."""
    parts = [part.partition("=") for part in text.split(",")]
    if len({key for key, _, _ in parts}) < len(parts):
        texts = "A name is repeated.", f"--{flag}", "the name again", "each name once"
        raise InvalidRequest(Issue("repeated_key", *texts))
    return [(key, value) for key, _, value in parts]


def _parse_list(text: str) -> list[Any]:
    from service.schemas.document import parse_document

    try:
        value = parse_document(text.encode())
    except (MalformedJson, UnicodeEncodeError):
        value = None
    except InvalidRequest as error:
        raise error.within("--operations") from None
    if not isinstance(value, list):
        message, got = "This must be a JSON list of operations.", "something else"
        raise InvalidRequest(Issue("wrong_type", message, "--operations", got, '[{"op": …}, …]'))
    return value
