"""Fuzzes all parsers, one after the other, for SECONDS in total: `make fuzz`.

The arguments are SECONDS, and optionally names of targets. The program prints each finding and
writes its input to build/fuzz/corpus/, which the next run empties. Each past finding has a test in
the folder of its parser.
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
    """Fuzzes a target; returns whether there are no findings."""
    command = [sys.executable, "-m", "tools.fuzz.one", name, str(seconds), str(FOLDER)]
    start = time.monotonic()
    result = subprocess.run(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False
    )
    elapsed = time.monotonic() - start
    output = result.stdout.decode("utf-8", "replace")
    match = re.search(r"number_of_executed_units: (\d+)", output)
    inputs = int(match.group(1)) if match else 0
    corpus = len(list((FOLDER / name).iterdir()))
    passes = result.returncode == 0 and inputs > 0
    outcome = "no finding" if passes else "FINDING"
    print(f"{name:10} {inputs:9} inputs {corpus:6} kept {elapsed:6.0f} s  {outcome}", flush=True)
    if not passes:
        print(output[-8000:], flush=True)
    return passes


def main(seconds: int, names: list[str]) -> bool:
    """Fuzzes the targets one after the other; returns whether there are no findings."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir(parents=True)
    targets = names or list(TARGETS)
    results = [fuzz(name, max(1, seconds // len(targets))) for name in targets]
    return all(results)


if __name__ == "__main__":
    sys.exit(0 if main(int(sys.argv[1]), sys.argv[2:]) else 1)
