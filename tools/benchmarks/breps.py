"""Measures the processor time of breps of some thousand faces from bytes to checked values."""

import time
from contextlib import AbstractContextManager

import orjson

from service.interpreter import pause_collection
from service.schemas.document import DEFAULT_LIMITS, MAX_FACES
from service.schemas.request import SurfaceRequest
from service.schemas.validation import parse_request
from tools.breps import Document, build_sheet, load_solid, repeat_solid

MAX_SECONDS = 2e-4
"""The most seconds of processor time for a face."""

REPETITIONS = 5

SOLIDS = ("gear", "plate", "crossholes", "impeller")


def run() -> bool:
    """Prints the time for each brep; returns whether all are within the limit."""
    breps = {name: load_solid(name) for name in SOLIDS}
    rows = {
        f"{name}, copies": repeat_solid(brep, -(-1000 // len(brep["faces"])))
        for name, brep in breps.items()
    }
    rows["sheet of lines"] = build_sheet(100, MAX_FACES // 100)
    print("breps, from bytes to value:")
    print("                     faces     MB     ms   ms a face")
    shares = [_measure(name, document) for name, document in rows.items()]
    print(f"slowest {max(shares) * 1e3:.3f} ms a face (allowed {MAX_SECONDS * 1e3:.1f})")
    return max(shares) <= MAX_SECONDS


def _measure(name: str, document: Document) -> float:
    """Prints the least time of some repetitions, and returns the seconds for a face."""
    body, faces = orjson.dumps({"surface": document}), len(document["faces"])
    seconds = []
    for _ in range(REPETITIONS):
        start = time.process_time()
        paused: AbstractContextManager[object] = pause_collection()  # as the service does
        with paused:
            parse_request(SurfaceRequest, body, DEFAULT_LIMITS).to_surface()
        seconds.append(time.process_time() - start)
    least = min(seconds)
    share = least / faces
    print(f"{name:20}{faces:6}{len(body) / 1e6:7.1f}{least * 1e3:7.0f}{share * 1e3:12.3f}")
    return share


if __name__ == "__main__":
    run()
