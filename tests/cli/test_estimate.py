"""`surface estimate`, computed locally and by a service."""

import json
from pathlib import Path

from service.cli.main import main

SURFACE = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]]}


def test_local_and_remote_output_are_equal(server: str, tmp_path: Path) -> None:
    ours, theirs, file = (tmp_path / name for name in ("ours.json", "theirs.json", "request.json"))
    file.write_text(json.dumps({"surface": SURFACE, "resolution": 7}), "utf-8")
    for source in ("tea-service", str(file)):
        command = ["estimate", source, "--resolution", "3,2", "--faces", "quads"]
        assert main([*command, "-o", str(ours)]) == 0
        assert main([*command, "-o", str(theirs), "--url", server]) == 0
        assert ours.read_bytes() == theirs.read_bytes()
    reported = json.loads(ours.read_bytes())
    assert (reported["vertices"], reported["quads"], reported["accepted"]) == (12, 6, True)
