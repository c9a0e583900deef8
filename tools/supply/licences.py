"""Writes `docs/licences.md`: the packages of other projects in the service, and their licences.

`python -m tools.supply.licences` fails for a licence that the project does not allow.
"""

import re
import sys
from contextlib import suppress
from importlib.metadata import Distribution

from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

from tools.supply.packages import ROOT, needed, scripts

PAGE = ROOT / "docs" / "licences.md"

ALLOWED = {
    "0BSD", "Apache-2.0", "BSD-2-Clause", "BSD-3-Clause", "CC0-1.0", "ISC", "MIT", "MPL-2.0",
    "PSF-2.0", "Unlicense", "Zlib",
}  # fmt: skip
"""Licences (SPDX) of packages that the service may ship unchanged. They require that their text is
shipped too, which it is. MPL-2.0 also requires that changes of its files are published."""

READ = {
    "httpcore": ("BSD License", "BSD-3-Clause"),
    "obstore": ("MIT License", "MIT"),
    "protobuf": ("3-Clause BSD License", "BSD-3-Clause"),
    "uvloop": ("MIT License; Apache Software License; MIT License", "MIT OR Apache-2.0"),
}
"""Packages without an SPDX expression: their own statement, and the licence that a person read in
their licence files (obstore has no such file). If a statement changes, a person must read the
licence again."""

INTRODUCTION = """\
# Licences

This page lists the packages of other projects in an installation of the service with all its
extras. The image has only the extra `meshopt`. `make licences` writes this page; a test compares
it with the installed packages, and fails for a licence that `tools/supply/licences.py` does not
allow. The texts of the licences are beside the packages, in `*.dist-info`, and beside the scripts.

Compiled packages contain libraries that this list does not name. NumPy contains OpenBLAS and
LAPACK (BSD) and the run-time libraries of GCC (GPL-3.0 with GCC's exception, and LGPL-2.1 for
libquadmath); its licence file lists them. Packages written in Rust (obstore, orjson,
pydantic_core) are linked with crates. The interface page (swagger-ui-dist) contains the packages
that its `NOTICE` names. Python itself and Debian's packages come with the base image, which has
their texts.

"""


class Unread(Exception):
    """The licence of a package has not been read yet, or is not one that we allow."""


def licence(package: Distribution) -> str:
    """The licence of a package as an SPDX expression.

    Raises
    ------
    Unread
        The package states no licence expression, and its licence has not been read.
    """
    for field in ("License-Expression", "License"):
        with suppress(InvalidLicenseExpression):
            return str(canonicalize_license_expression(_first_line(package, field)))
    declared, expected = READ.get(package.name.lower(), (None, ""))
    if statement(package) != declared:
        raise Unread(
            f"{package.name} says {statement(package)!r}: read its licence, and add it to READ"
        )
    return expected


def statement(package: Distribution) -> str:
    """The licence fields of a package that states no expression."""
    classifiers = package.metadata.get_all("Classifier") or []
    named = [c.rpartition(" :: ")[2] for c in classifiers if c.startswith("License :: ")]
    return "; ".join(filter(None, [_first_line(package, "License"), *named]))


def _first_line(package: Distribution, field: str) -> str:
    (text,) = package.metadata.get_all(field) or [""]
    return str(text).partition("\n")[0]


def check(name: str, expression: str) -> str:
    """The expression, if all licences that it names are allowed, alternatives included.

    Raises
    ------
    Unread
        The expression names a licence that is not allowed.
    """
    named = set(re.findall(r"[^\s()]+", expression)) - {"AND", "OR", "WITH"}
    if not named or named - ALLOWED:
        raise Unread(f"{name}: {expression!r} is not allowed")
    return expression


def page() -> str:
    """The text of the page."""
    lines = ["| Python package | version | licence |", "| --- | --- | --- |"]
    for name, each in needed().items():
        lines.append(f"| {each.name} | {each.version} | {check(name, licence(each))} |")
    lines += ["", "| npm package | version | licence |", "| --- | --- | --- |"]
    for script in scripts():
        terms = check(script.name, str(canonicalize_license_expression(script.licence)))
        lines.append(f"| {script.name} | {script.version} | {terms} |")
    return INTRODUCTION + "\n".join([*lines, ""])


if __name__ == "__main__":
    try:
        PAGE.write_text(page(), encoding="utf-8")
    except Unread as problem:
        sys.exit(str(problem))
