"""Runs the Khronos glTF validator on Node."""

import atexit
import json
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

from tools.programs import find_node_package, find_program

SCRIPT = Path(__file__).with_suffix(".mjs")

UNUSED = "UNUSED_OBJECT"
"""Code of an issue of the validator: for example, texture coordinates without a texture."""


@cache
def _start_validator() -> subprocess.Popen[str]:
    """The process of the validator, which reads paths of files and writes reports.

    It starts only once, because starting Node takes longer than the validation of most files.
    """
    command = [find_program("node"), str(SCRIPT), str(find_node_package("gltf-validator"))]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    atexit.register(process.kill)
    return process


def validate(path: Path) -> dict[str, Any]:
    """The validator's report on a `.gltf` or `.glb` file, with issues of all severities."""
    process = _start_validator()
    assert process.stdin is not None
    assert process.stdout is not None
    print(path, file=process.stdin, flush=True)
    report: dict[str, Any] = json.loads(process.stdout.readline())
    return report


def list_issues(content: bytes, path: Path) -> list[dict[str, Any]]:
    """Issues of all severities in a glTF file, which this function writes to `path`.

    Issues about unused texture coordinates are left out: the service writes no textures.
    """
    path.write_bytes(content)
    messages: list[dict[str, Any]] = validate(path)["issues"]["messages"]
    return [
        message
        for message in messages
        if not (message["code"] == UNUSED and message["pointer"].endswith("/TEXCOORD_0"))
    ]
