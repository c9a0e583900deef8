"""Fuzzes every parser, one after the other, for SECONDS in total: `make fuzz`.

Its arguments are the seconds, and optionally names of targets. It prints each finding and keeps its
input in build/fuzz/. Each past finding is a test in the room of its parser.
"""

import re
import shutil
import subprocess
import sys
import time

from tools.fuzz.targets import TARGETS
from tools.processes import ROOT

FOLDER = ROOT / "build" / "fuzz" / "corpus"


def fuzz(name: str, seconds: int) -> bool:
    """Fuzzes a target; returns whether nothing was found."""
    command = [sys.executable, "-m", "tools.fuzz.one", name, str(seconds), str(FOLDER)]
    start = time.monotonic()
    done = subprocess.run(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False
    )
    elapsed = time.monotonic() - start
    output = done.stdout.decode("utf-8", "replace")
    counted = re.search(r"number_of_executed_units: (\d+)", output)
    inputs = int(counted.group(1)) if counted else 0
    kept = len(list((FOLDER / name).iterdir()))
    ok = done.returncode == 0 and inputs > 0
    outcome = "nothing found" if ok else "FOUND"
    print(f"{name:10} {inputs:9} inputs {kept:6} kept {elapsed:6.0f} s  {outcome}", flush=True)
    if not ok:
        print(output[-8000:], flush=True)
    return ok


def main(seconds: int, names: list[str]) -> bool:
    """Fuzzes the targets; returns whether nothing was found."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir(parents=True)
    chosen = names or list(TARGETS)
    clean = [fuzz(name, max(1, seconds // len(chosen))) for name in chosen]
    return all(clean)


if __name__ == "__main__":
    sys.exit(0 if main(int(sys.argv[1]), sys.argv[2:]) else 1)
