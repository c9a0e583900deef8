"""Judges the live service by its own OpenAPI document: `make test-api`.

schemathesis makes up requests from the document, good and bad ones, one by one and in rows that
follow its links, and judges each answer. Called with the path of its program and the least number
of requests; fails if it finds anything, or made up fewer.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.process import ROOT, Service, service_process

SETTINGS = {"SURFACE_ACCESS_LOG": "false", "SURFACE_ALLOW_DELETE": "true"}
"""Surfaces are kept in memory, and may be deleted, so that rows of requests come to their end."""
SEED = 20260101


def judged(program: str, service: Service, examples: int, *options: str) -> tuple[int, int]:
    """Exit code, and the number of requests made up; what is found is printed."""
    command = [
        program,
        f"--config-file={Path(__file__).with_name('schemathesis.toml')}",
        "run",
        f"{service.url}/openapi.json",
        "--checks=all",
        f"--max-examples={examples}",
        f"--seed={SEED}",
        "--warnings=off",
        *options,
    ]
    with tempfile.TemporaryDirectory() as database:
        # Nothing is remembered from one run to the next.
        environment = os.environ | {
            "HYPOTHESIS_STORAGE_DIRECTORY": database,
            "SCHEMATHESIS_HOOKS": str(Path(__file__).with_name("schemathesis_hooks.py")),
            "NO_COLOR": "1",
        }
        judging = subprocess.Popen(
            command, cwd=database, env=environment, stdout=subprocess.PIPE, text=True
        )
        lines = []
        with judging:
            assert judging.stdout is not None
            for line in judging.stdout:
                print(line, end="", flush=True)
                lines.append(line)
    counted = re.search(r"(\d+) generated", "".join(lines))
    return judging.returncode, int(counted.group(1)) if counted else 0


def main(program: str, least: int) -> bool:
    """Whether nothing was found in enough requests."""
    with service_process(ROOT / "build" / "api", SETTINGS) as service:
        code, count = judged(str(Path(program).absolute()), service, EXAMPLES)
        failed = service.log.read_text(encoding="utf-8").count("Traceback")
    print(f"{count} requests of at least {least}, {failed} exceptions in the log of the service")
    return code == 0 and count >= least and not failed


EXAMPLES = 150
"""The most requests of one operation in one phase."""

if __name__ == "__main__":
    sys.exit(0 if main(sys.argv[1], int(sys.argv[2])) else 1)
