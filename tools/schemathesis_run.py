"""Compares a running service with its OpenAPI document: `make test-api`.

Schemathesis generates valid and invalid requests from the document, and sequences of requests that
follow links, and judges each response. The first service needs no keys; the second service needs
keys. The arguments are the path of schemathesis and the least number of requests for the first
service; a quarter of it is enough for the second. The program fails if schemathesis finds a fault
or sends fewer requests, or if a service logs an exception.
"""

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from service.api.guard.keys import SCOPES, format_entry, make_key
from tools.processes import ROOT, Server, service_server

OPEN_SETTINGS = {"SURFACE_ACCESS_LOG": "false", "SURFACE_ALLOW_DELETE": "true"}
"""Settings with which clients may delete surfaces, so that every sequence of requests is
possible."""

PRIVATE_SETTINGS = OPEN_SETTINGS | {
    "SURFACE_PUBLIC_READS": "false",
    "SURFACE_METRICS": "key",
    "SURFACE_SIGNING_KEYS": "0123456789abcdef" * 2,
}
"""Settings with which all requests need a key; `main` adds the key."""

SEED = 20260101

OPEN_EXAMPLES, PRIVATE_EXAMPLES = 200, 25
"""The largest number of requests of one operation in one phase of schemathesis."""

REQUEST_TIMEOUT = 30
"""Seconds within which each response must be complete: half of the default of
SURFACE_REQUEST_TIMEOUT."""

RULES = Path(__file__).with_name("schemathesis.toml")
HOOKS = Path(__file__).with_name("schemathesis_hooks.py")


def run_schemathesis(
    program: str, service: Server, examples: int, key_rules: str = ""
) -> tuple[int, int]:
    """Runs schemathesis and prints its output; returns its exit code and the number of requests.

    `key_rules` make schemathesis send a key; they are appended to the settings of
    `schemathesis.toml`.
    """
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "schemathesis.toml"
        config.write_text(RULES.read_text(encoding="utf-8") + key_rules, encoding="utf-8")
        command = [
            program,
            f"--config-file={config}",
            "run",
            f"{service.url}/openapi.json",
            f"--max-examples={examples}",
            f"--seed={SEED}",
            "--warnings=off",
            f"--max-response-time={REQUEST_TIMEOUT}",
        ]
        # The folder is temporary, so that a run does not depend on examples of earlier runs.
        environment = os.environ | {
            "HYPOTHESIS_STORAGE_DIRECTORY": folder,
            "SCHEMATHESIS_HOOKS": str(HOOKS),
            "NO_COLOR": "1",
        }
        lines = []
        with subprocess.Popen(
            command, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True
        ) as process:
            assert process.stdout is not None
            for line in process.stdout:
                print(line, end="", flush=True)
                lines.append(line)
    match = re.search(r"(\d+) generated", "".join(lines))
    return process.returncode, int(match.group(1)) if match else 0


def judge_service(
    program: str,
    settings: Mapping[str, str],
    examples: int,
    min_requests: int,
    key_rules: str = "",
) -> bool:
    """Starts a service with these settings and tests it; returns whether it passes all tests."""
    with service_server(ROOT / "build" / "api", settings) as service:
        code, count = run_schemathesis(program, service, examples, key_rules)
        traces = service.log.read_text(encoding="utf-8").count("Traceback")
    print(f"{count} requests (at least {min_requests}), {traces} exceptions in the log\n")
    return code == 0 and count >= min_requests and not traces


def main(program: str, min_requests: int) -> bool:
    """Whether the service passes without keys and with keys."""
    schemathesis = str(Path(program).absolute())
    passes_without_keys = judge_service(schemathesis, OPEN_SETTINGS, OPEN_EXAMPLES, min_requests)
    key = make_key()
    settings = PRIVATE_SETTINGS | {
        "SURFACE_API_KEYS": format_entry("judge", key, frozenset(SCOPES))
    }
    key_rules = f'\n[auth.openapi.key]\nbearer = "{key}"\n'
    return (
        judge_service(schemathesis, settings, PRIVATE_EXAMPLES, min_requests // 4, key_rules)
        and passes_without_keys
    )


if __name__ == "__main__":
    sys.exit(0 if main(sys.argv[1], int(sys.argv[2])) else 1)
