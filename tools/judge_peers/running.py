"""Runs other mesh makers: a process for each, which is ended if a mesh takes too long."""

import json
import os
import select
import subprocess
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tools.judge_peers.makers.protocol import MARK
from tools.judge_peers.wishes import (
    Ask,
    ask_grid_by_count,
    ask_grid_by_formula,
    ask_radii,
    ask_tolerance,
    ask_turns,
)

MAX_SECONDS = 10.0
"""A mesh that takes more CPU time, with the reading of its surface, counts as not made."""

MAX_WAIT = 120.0
"""The most seconds that the start of a maker may take, or a mesh on a busy machine."""

TOO_SLOW = f"more than {MAX_SECONDS:g} s"
"""The error of a mesh that takes too long."""

TICKS = os.sysconf("SC_CLK_TCK")
"""Units of CPU time in a second, in /proc."""


@dataclass(frozen=True)
class Maker:
    """A mesh maker.

    `environment` is the folder of its Python, `arguments` the module of its program and what
    follows, and `promise` what its documentation says of the distance.
    """

    name: str
    environment: str
    arguments: tuple[str, ...]
    ask: Ask
    asked: str
    promise: str


MAKERS = (
    Maker(
        "Open CASCADE", "occ", ("open_cascade",), ask_tolerance,
        "linear deflection = the tolerance, angular deflection 0.5",
        "the deflection is a target for chords, no bound",
    ),
    Maker(
        "arris", "peers", ("arris",), ask_tolerance,
        "chord = the tolerance",
        "every position within the chord of the surface it stands on; closed along shared edges",
    ),
    Maker(
        "gmsh", "peers", ("gmsh",), ask_turns,
        "`MeshSizeFromCurvature`: the elements of a full turn that keep the tolerance on a circle "
        "as wide as the diagonal",
        "none: sizes of elements",
    ),
    Maker(
        "Netgen", "peers", ("netgen",), ask_radii,
        "`curvaturesafety`: the elements of a radius, from the same circle",
        "none: sizes of elements",
    ),
    Maker(
        "geomdl", "peers", ("grids", "geomdl"), ask_grid_by_formula,
        "a grid by the usual estimate, (Duu + 2 Duv + Dvv) / (8 n²), with sampled derivatives",
        "none: a number of samples",
    ),
    Maker(
        "splinepy", "peers", ("grids", "splinepy"), ask_grid_by_count,
        "a grid with the number of our triangles",
        "none: a number of samples",
    ),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Made:
    """A mesh, or the reason why there is none."""

    vertices: NDArray[np.float64] | None = None
    faces: NDArray[np.int64] | None = None
    seconds: float = 0.0
    error: str = ""


@dataclass(eq=False)
class Runner:
    """A maker's process, which starts when it is needed.

    `folder` gets the meshes and the answers; if `keeps`, meshes that are there are not made again.
    `version` is what the maker said at its start, `unread` the begin of a line, and `slow` has the
    names of surfaces of which a mesh took too long.
    """

    maker: Maker
    folder: Path
    keeps: bool = False
    version: str = ""
    process: "subprocess.Popen[bytes] | None" = None
    unread: bytes = field(default=b"", repr=False)
    slow: set[str] = field(default_factory=set)

    @property
    def python(self) -> Path:
        """The Python of the maker."""
        return Path("build") / self.maker.environment / "bin" / "python"

    @property
    def command(self) -> list[str]:
        """The command that starts the maker."""
        module, *rest = self.maker.arguments
        return [str(self.python), "-m", f"tools.judge_peers.makers.{module}", *rest]

    def make(self, case: str, relative: float, fields: Mapping[str, Any]) -> Made:
        """The mesh of a case at a relative tolerance, which the maker makes for a request.

        A surface that took too long is not tried again: requests become finer.
        """
        name = f"{case} {relative:g} {self.maker.name}".replace(", ", "-").replace(" ", "-")
        out = self.folder / f"{name}.npz"
        if not (self.keeps and (self.folder / f"{name}.json").exists()):
            answer = {"error": TOO_SLOW} if case in self.slow else None
            answer = answer or self._ask({**fields, "out": str(out)})
            if answer.get("error") == TOO_SLOW:
                self.slow.add(case)
            answer = answer | {"version": self.version}
            (self.folder / f"{name}.json").write_text(json.dumps(answer), encoding="utf-8")
        answer = json.loads((self.folder / f"{name}.json").read_text(encoding="utf-8"))
        self.version = answer["version"]
        if "error" in answer:
            return Made(error=answer["error"])
        arrays = np.load(out)
        return Made(arrays["vertices"], arrays["faces"], answer["seconds"])

    def close(self) -> None:
        """Ends the process."""
        if self.process is not None:
            self.process.kill()
            self.process.communicate()
            self.process, self.unread = None, b""

    def _ask(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """The answer to a request; the process ends if there is none in time."""
        if self.process is None:
            self._start()
        assert self.process is not None
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(request).encode() + b"\n")
        self.process.stdin.flush()
        return self._read(self._count_seconds() + MAX_SECONDS)

    def _start(self) -> None:
        self.process = subprocess.Popen(
            self.command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
        hello = self._read(MAX_WAIT)
        if "version" not in hello:
            raise SystemExit(f"{self.maker.name} does not start: {hello}")
        self.version = hello["version"]

    def _count_seconds(self) -> float:
        """The CPU time of the process so far: proc_pid_stat(5), after the name in brackets."""
        assert self.process is not None
        text = Path(f"/proc/{self.process.pid}/stat").read_text(encoding="ascii")
        user, system = text.rpartition(")")[2].split()[11:13]
        return (int(user) + int(system)) / TICKS

    def _read(self, most: float) -> dict[str, Any]:
        """The next answer; an error if the process ends, or has used more than `most` CPU time."""
        assert self.process is not None
        assert self.process.stdout is not None
        end = time.monotonic() + MAX_WAIT
        descriptor = self.process.stdout.fileno()
        while True:
            line, is_complete, rest = self.unread.partition(b"\n")
            if is_complete:
                self.unread = rest
                if line.startswith(MARK.encode()):
                    answer: dict[str, Any] = json.loads(line[len(MARK) :])
                    return answer
                continue
            if not select.select([descriptor], [], [], 0.25)[0]:
                if time.monotonic() > end or self._count_seconds() > most:
                    self.close()
                    return {"error": TOO_SLOW}
                continue
            chunk = os.read(descriptor, 1 << 16)
            if not chunk:
                status = self.process.wait()
                self.close()
                return {"error": f"the process ended with status {status}"}
            self.unread += chunk
