"""Writes `docs/licences.md`, a list of the packages of other projects and of their licences.

`python -m tools.supply.licences` fails if a package has a licence that this project does not allow.
"""

import re
import sys
from contextlib import suppress
from importlib.metadata import Distribution

from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

from tools.supply.packages import ROOT, list_packages, list_scripts

PAGE = ROOT / "docs" / "licences.md"

ALLOWED_LICENCES = {
    "0BSD", "Apache-2.0", "Apache-2.0 WITH LLVM-exception", "BSD-2-Clause", "BSD-3-Clause",
    "CC0-1.0", "ISC", "MIT", "MIT-CMU", "MPL-2.0", "PSF-2.0", "Unlicense", "Zlib",
}  # fmt: skip
"""Licences (SPDX) of packages that may be shipped with the service, unchanged. They require that
their text is shipped, too; each package contains it. MPL-2.0 also requires that changes of its
files are published. A licence with an exception (`WITH`) is a licence of its own."""

LICENCE = re.compile(r"[^\s()]+(?:\s+WITH\s+[^\s()]+)?")
"""One licence of an SPDX expression, with its exception; or an operator between two."""

READ_LICENCES = {
    "httpcore": ("BSD License", "BSD-3-Clause"),
    "jinja2": ("BSD License", "BSD-3-Clause"),
    "obstore": ("MIT License", "MIT"),
    "partd": ("BSD", "BSD-3-Clause"),
    "protobuf": ("3-Clause BSD License", "BSD-3-Clause"),
    "sortedcontainers": ("Apache 2.0; Apache Software License", "Apache-2.0"),
    "trimesh": ("The MIT License (MIT); MIT License", "MIT"),
    "uvloop": ("MIT License; Apache Software License; MIT License", "MIT OR Apache-2.0"),
    "zict": ("BSD; BSD License", "BSD-3-Clause"),
}
"""Packages without an SPDX expression: the statement in their metadata, and the licence that a
person read in their licence files (obstore has no licence file). If a statement changes, a person
must read the licence again."""

INTRODUCTION = """\
# Licences

This page lists the packages of other projects in an installation of the service with all its
extras. The image has only the extras `cluster`, `meshopt` and `rhino`. `make licences` writes this
page; a test compares it with the installed packages, and fails for a licence that
`tools/supply/licences.py` does not allow. The texts of the licences are beside the packages, in
`*.dist-info`, and beside the scripts.

Compiled packages contain libraries that this list does not name. NumPy contains OpenBLAS and
LAPACK (BSD) and the run-time libraries of GCC (GPL-3.0 with GCC's exception, and LGPL-2.1 for
libquadmath); its licence file lists them. Packages written in Rust (obstore, orjson,
pydantic_core) are linked with crates. The interface page (swagger-ui-dist) contains the packages
that its `NOTICE` names. Python itself and Debian's packages come with the base image, which has
their texts.

"""


class UnknownLicence(Exception):
    """A person has not read the licence of a package yet, or the licence is not allowed."""


def find_licence(package: Distribution) -> str:
    """The licence of a package as an SPDX expression.

    Raises
    ------
    UnknownLicence
        The metadata have no SPDX expression, and no person has read the licence.
    """
    for field in ("License-Expression", "License"):
        with suppress(InvalidLicenseExpression):
            return str(canonicalize_license_expression(_first_line(package, field)))
    statement, licence = READ_LICENCES.get(package.name.lower(), (None, ""))
    if read_statement(package) != statement:
        raise UnknownLicence(
            f"{package.name} says {read_statement(package)!r}: read its licence, "
            "and add it to READ_LICENCES"
        )
    return licence


def read_statement(package: Distribution) -> str:
    """The texts of the licence fields of a package that has no SPDX expression."""
    classifiers = package.metadata.get_all("Classifier") or []
    names = [c.rpartition(" :: ")[2] for c in classifiers if c.startswith("License :: ")]
    return "; ".join(filter(None, [_first_line(package, "License"), *names]))


def _first_line(package: Distribution, field: str) -> str:
    """The first line of a field of the metadata; empty if the field is missing."""
    (text,) = package.metadata.get_all(field) or [""]
    return str(text).partition("\n")[0]


def check_licence(name: str, expression: str) -> str:
    """The expression, if all licences in it are allowed, also those that are alternatives.

    Raises
    ------
    UnknownLicence
        The expression names a licence that is not allowed.
    """
    names = {" ".join(name.split()) for name in LICENCE.findall(expression)} - {"AND", "OR"}
    if not names or names - ALLOWED_LICENCES:
        raise UnknownLicence(f"{name}: {expression!r} is not allowed")
    return expression


def write_page() -> str:
    """The text of `docs/licences.md`."""
    lines = ["| Python package | version | licence |", "| --- | --- | --- |"]
    for name, each in list_packages().items():
        lines.append(
            f"| {each.name} | {each.version} | {check_licence(name, find_licence(each))} |"
        )
    lines += ["", "| npm package | version | licence |", "| --- | --- | --- |"]
    for script in list_scripts():
        terms = check_licence(script.name, str(canonicalize_license_expression(script.licence)))
        lines.append(f"| {script.name} | {script.version} | {terms} |")
    return INTRODUCTION + "\n".join([*lines, ""])


if __name__ == "__main__":
    try:
        PAGE.write_text(write_page(), encoding="utf-8")
    except UnknownLicence as problem:
        sys.exit(str(problem))
