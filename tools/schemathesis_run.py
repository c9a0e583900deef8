"""Compares the live service with its own OpenAPI document: `make test-api`.

Schemathesis generates valid and invalid requests from the document, single ones and sequences that
follow links, and judges each response. At first the service is open; then, for fewer requests, it
needs keys. The arguments are the path of schemathesis and the least number of requests. The program
fails if schemathesis finds a fault, or sent fewer requests.
"""

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from service.api.guard.keys import entry_line, new_key
from tools.processes import ROOT, Server, service_server

OPEN = {"SURFACE_ACCESS_LOG": "false", "SURFACE_ALLOW_DELETE": "true"}
"""Surfaces are kept in memory and may be deleted, so that every sequence of requests is
possible."""

PRIVATE = OPEN | {
    "SURFACE_PUBLIC_READS": "false",
    "SURFACE_METRICS": "key",
    "SURFACE_SIGNING_KEYS": "0123456789abcdef" * 2,
}
"""Everything that can need a key needs one; the key is added later."""

SEED = 20260101

OPEN_EXAMPLES, PRIVATE_EXAMPLES = 200, 25
"""The most requests of one operation in one phase."""

REQUEST_TIMEOUT = 30
"""Seconds that a response may take: half of the default of SURFACE_REQUEST_TIMEOUT."""

RULES = Path(__file__).with_name("schemathesis.toml")
HOOKS = Path(__file__).with_name("schemathesis_hooks.py")


def judged(program: str, service: Server, examples: int, rules: str = "") -> tuple[int, int]:
    """Runs schemathesis; returns its exit code and the number of requests; prints findings."""
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "schemathesis.toml"
        config.write_text(RULES.read_text(encoding="utf-8") + rules, encoding="utf-8")
        command = [
            program,
            f"--config-file={config}",
            "run",
            f"{service.url}/openapi.json",
            "--checks=all",
            f"--max-examples={examples}",
            f"--seed={SEED}",
            "--warnings=off",
            f"--max-response-time={REQUEST_TIMEOUT}",
        ]
        # Without a database of examples, runs do not depend on earlier ones.
        environment = os.environ | {
            "HYPOTHESIS_STORAGE_DIRECTORY": folder,
            "SCHEMATHESIS_HOOKS": str(HOOKS),
            "NO_COLOR": "1",
        }
        lines = []
        with subprocess.Popen(
            command, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True
        ) as judging:
            assert judging.stdout is not None
            for line in judging.stdout:
                print(line, end="", flush=True)
                lines.append(line)
    counted = re.search(r"(\d+) generated", "".join(lines))
    return judging.returncode, int(counted.group(1)) if counted else 0


def passes(
    program: str, settings: Mapping[str, str], examples: int, least: int, rules: str = ""
) -> bool:
    """Whether a service with these settings passes, with enough requests."""
    with service_server(ROOT / "build" / "api", settings) as service:
        code, count = judged(program, service, examples, rules)
        traces = service.log.read_text(encoding="utf-8").count("Traceback")
    print(f"{count} requests of at least {least}, {traces} exceptions in the log of the service\n")
    return code == 0 and count >= least and not traces


def main(program: str, least: int) -> bool:
    """Whether the service passes, both open and with keys."""
    judge = str(Path(program).absolute())
    is_open = passes(judge, OPEN, OPEN_EXAMPLES, least)
    key = new_key()
    private = PRIVATE | {"SURFACE_API_KEYS": entry_line("judge", key)}
    has_key = f'\n[auth.openapi.key]\nbearer = "{key}"\n'
    return passes(judge, private, PRIVATE_EXAMPLES, least // 4, has_key) and is_open


if __name__ == "__main__":
    sys.exit(0 if main(sys.argv[1], int(sys.argv[2])) else 1)
