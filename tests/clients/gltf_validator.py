"""Runs the Khronos glTF validator on Node."""

import atexit
import json
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

from tests.programs import find_node_package, find_program

SCRIPT = Path(__file__).with_suffix(".mjs")

UNUSED = "UNUSED_OBJECT"
"""The code of the validator's note about texture coordinates without a texture."""


@cache
def _start_validator() -> subprocess.Popen[str]:
    """The process of the validator, started once, because starting Node takes longer than most
    files."""
    command = [find_program("node"), str(SCRIPT), str(find_node_package("gltf-validator"))]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    atexit.register(process.kill)
    return process


def validate(path: Path) -> dict[str, Any]:
    """Return the report on a `.gltf` or `.glb` file; its issues are of every severity."""
    process = _start_validator()
    assert process.stdin is not None
    assert process.stdout is not None
    print(path, file=process.stdin, flush=True)
    report: dict[str, Any] = json.loads(process.stdout.readline())
    return report


def list_issues(content: bytes, path: Path) -> list[dict[str, Any]]:
    """Issues of all severities in a file of this content, unused texture coordinates aside."""
    path.write_bytes(content)
    messages: list[dict[str, Any]] = validate(path)["issues"]["messages"]
    return [
        message
        for message in messages
        if not (message["code"] == UNUSED and message["pointer"].endswith("/TEXCOORD_0"))
    ]
