"""The Khronos glTF validator, run on Node: the judge of what is valid glTF."""

import json
import subprocess
from pathlib import Path
from typing import Any

from tests.programs import node_package, program

SCRIPT = Path(__file__).with_suffix(".mjs")

UNUSED = "UNUSED_OBJECT"
"""Said, for information, of texture coordinates without a texture."""


def validate(path: Path) -> dict[str, Any]:
    """Return the report on a `.gltf` or `.glb` file; its issues are of every severity."""
    command = [program("node"), str(SCRIPT), str(node_package("gltf-validator")), str(path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    report: dict[str, Any] = json.loads(done.stdout)
    return report


def issues(content: bytes, path: Path) -> list[dict[str, Any]]:
    """Issues of all severities in a file of this content, unused texture coordinates aside."""
    path.write_bytes(content)
    messages: list[dict[str, Any]] = validate(path)["issues"]["messages"]
    return [
        message
        for message in messages
        if not (message["code"] == UNUSED and message["pointer"].endswith("/TEXCOORD_0"))
    ]
