"""Fuzzes every parser, one after the other, for SECONDS together: `make fuzz`.

Called with the seconds, and with the names of targets where not all are meant. Whatever is found
is printed, and its input kept in build/fuzz/; what has been found there once is a test of its own
in the rooms of the parsers.
"""

import re
import shutil
import subprocess
import sys
import time

from tools.fuzz.targets import TARGETS
from tools.processes import ROOT

FOLDER = ROOT / "build" / "fuzz" / "corpus"


def fuzzed(name: str, seconds: int) -> bool:
    """Whether a target was fuzzed and nothing was found."""
    command = [sys.executable, "-m", "tools.fuzz.one", name, str(seconds), str(FOLDER)]
    start = time.monotonic()
    done = subprocess.run(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False
    )
    taken = time.monotonic() - start
    output = done.stdout.decode("utf-8", "replace")
    counted = re.search(r"number_of_executed_units: (\d+)", output)
    inputs = int(counted.group(1)) if counted else 0
    kept = len(list((FOLDER / name).iterdir()))
    ok = done.returncode == 0 and inputs > 0
    said = "nothing found" if ok else "FOUND"
    print(f"{name:10} {inputs:9} inputs {kept:6} kept {taken:6.0f} s  {said}", flush=True)
    if not ok:
        print(output[-8000:], flush=True)
    return ok


def main(seconds: int, names: list[str]) -> bool:
    """Whether nothing was found in any target."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir(parents=True)
    chosen = names or list(TARGETS)
    clean = [fuzzed(name, max(1, seconds // len(chosen))) for name in chosen]
    return all(clean)


if __name__ == "__main__":
    sys.exit(0 if main(int(sys.argv[1]), sys.argv[2:]) else 1)
