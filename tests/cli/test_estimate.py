"""`surface estimate` prints the same, whether this process or a service computes the result."""

import json
from pathlib import Path

from service.cli.main import main

SURFACE = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]]}


def test_local_and_remote_output_are_equal(server: str, tmp_path: Path) -> None:
    local, remote, request = (tmp_path / f"{name}.json" for name in ("local", "remote", "request"))
    request.write_text(json.dumps({"surface": SURFACE, "resolution": 7}), "utf-8")
    for source in ("tea-service", str(request)):
        command = ["estimate", source, "--resolution", "3,2", "--faces", "quads"]
        assert main([*command, "-o", str(local)]) == 0
        assert main([*command, "-o", str(remote), "--url", server]) == 0
        assert local.read_bytes() == remote.read_bytes()
    # `local` now has the estimate for the file: one patch. The option replaces its resolution 7:
    # with 3 × 2 divisions, the patch has 4 × 3 vertices and 3 × 2 quads.
    estimate = json.loads(local.read_bytes())
    assert (estimate["vertices"], estimate["quads"], estimate["accepted"]) == (12, 6, True)
