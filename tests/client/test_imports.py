"""The client is typed, and to import it loads httpx and NumPy, and nothing of the service."""

import json
import subprocess
import sys
from importlib.metadata import requires
from pathlib import Path

from mypy import api

ROOT = Path(__file__).parents[2]

CACHE = ROOT / ".mypy_cache" / "script"
"""The folder of the script, which keeps the types of NumPy: mypy needs 15 s to read them."""

LIST_MODULES = """
import json, sys
import httpx, numpy
before = set(sys.modules)
import service.client
print(json.dumps(sorted(set(sys.modules) - before)))
"""

SCRIPT = """
import asyncio
import numpy as np
from pathlib import Path
from service.client import AsyncClient, Client, Local, Mesh, Points, ServiceError, bezier, bspline

client = Client("http://127.0.0.1:8000", key="secret", timeout=30)
patch = bezier(np.zeros((4, 4, 3)))
mesh: Mesh = client.mesh(patch, resolution=(8, 8), overlays=["boundary"])
corners: np.ndarray[tuple[int, ...], np.dtype[np.float64]] = mesh.vertices[mesh.faces]
points: Points = client.points(Path("net.npy"), uv=[[0.5, 0.5]], type="bspline")
volume = client.measure("sphere").volume
if volume is not None:
    print(volume.value + 1.0)
try:
    Local().mesh(client.convert(bspline(np.zeros((9, 9, 3)), 3, "uniform"), operations=[]))
except ServiceError as error:
    print([issue.pointer.upper() for issue in error.errors], error.status + 1)

async def ask() -> Mesh:
    async with AsyncClient("http://127.0.0.1:8000") as client:
        return await client.mesh("sphere")

print(asyncio.run(ask()).report.watertight)
for result in client.job([Client.mesh.part("sphere", tolerance=0.1)]):
    print(result.status if isinstance(result, ServiceError) else result.vertices.mean())
reveal_type(client.store(patch).id)
client.mesh(patch, resolutoin=3)
client.points(patch).dw
asyncio.run(ask()).vertexes
"""


def test_importing_the_client_loads_nothing_of_the_service() -> None:
    process = subprocess.run(
        [sys.executable, "-c", LIST_MODULES], cwd=ROOT, capture_output=True, text=True, check=True
    )
    loaded = json.loads(process.stdout)
    own = [name for name in loaded if name.partition(".")[0] == "service"]
    assert {name for name in own if not name.startswith("service.client")} == {"service"}
    assert "service.client.local" not in own
    libraries = {name.partition(".")[0] for name in loaded} & {
        line.partition(" ")[0].partition(";")[0].replace("-", "_")
        for line in requires("surface-service") or ()
    }
    assert libraries <= {"httpx", "numpy"}
    assert len(own) <= 17


def test_mypy_checks_a_script_of_a_user() -> None:
    CACHE.mkdir(parents=True, exist_ok=True)
    script = CACHE / "script.py"
    script.write_text(SCRIPT, encoding="utf-8")
    output, errors, _ = api.run(["--strict", "--config-file=", f"--cache-dir={CACHE}", str(script)])
    assert errors == ""
    lines = SCRIPT.splitlines()
    found = {
        lines[int(line.split(":")[1]) - 1]: line.split(": ", 2)[2]
        for line in output.splitlines()
        if "script.py:" in line
    }
    assert found.pop("reveal_type(client.store(patch).id)").endswith('str"')
    assert list(found) == lines[-3:], output
