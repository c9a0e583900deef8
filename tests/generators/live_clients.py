"""Generators make clients from the document of a live service: `make test-generators`.

The clients compute a mesh as JSON and as GLB, a mesh by URL with lists in its query, and a
projection, and are refused once. What the generators write is not edited. The service has keys and
all optional features. `GENERATORS_PYTHON` is the Python of an environment with the generators for
Python; those for TypeScript are in this folder (`npm ci`).
"""

import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import httpx
import pytest

from service.api.guard.keys import SCOPES, format_entry, make_key
from service.api.openapi.document import build_full_settings
from tools.live import run_service
from tools.programs import find_program

FOLDER = Path(__file__).parent
PYTHON = Path(os.environ["GENERATORS_PYTHON"]).absolute()

OPTIONS = {
    "strict": True,
    "noUncheckedIndexedAccess": True,
    "target": "es2022",
    "module": "es2022",
    "moduleResolution": "bundler",
    "lib": ["es2023", "dom", "dom.iterable"],
    "types": [],
    "noEmit": True,
}
"""Options of the compiler of TypeScript, which checks the declarations of packages, too."""

RECEIVED = {
    "vertices": 12,
    "triangles": 12,
    "byUrl": 12,
    "distance": pytest.approx(0.4375**0.5),
    "status": 422,
    "code": "out_of_range",
    "pointer": "/resolution",
}
"""The report of every client: of 2 × 3 divisions, of a point above the bowl, of a refusal."""


class Service(NamedTuple):
    """A running service, and a key for all its calls."""

    url: str
    key: str


@pytest.fixture(scope="module")
def service() -> Iterator[Service]:
    key = make_key()
    entry = format_entry("all", key, frozenset(SCOPES))
    changes = {"api_keys": (entry,), "rate_limit": 0, "compute_limit": 0}
    with run_service(build_full_settings().model_copy(update=changes)) as url:
        yield Service(url, key)


@pytest.fixture(scope="module")
def document(service: Service, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of the document that the service serves."""
    path = tmp_path_factory.mktemp("document") / "openapi.json"
    path.write_bytes(httpx.get(f"{service.url}/openapi.json").content)
    return path


def run(folder: Path, *command: str | Path, **variables: str) -> str:
    """The output of a program that runs in this folder; a program that fails raises."""
    path = os.pathsep.join((str(PYTHON.parent), os.environ.get("PATH", os.defpath)))
    quiet = {"REDOCLY_SUPPRESS_UPDATE_NOTICE": "true", "REDOCLY_TELEMETRY": "off", "CI": "1"}
    result = subprocess.run(
        list(map(str, command)),
        cwd=folder,
        env={**os.environ, **quiet, "PATH": path, **variables},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stdout[-4000:]
    return result.stdout


def run_package(folder: Path, program: str, *arguments: str | Path, **variables: str) -> str:
    """The output of a program of the npm packages in this folder."""
    command = FOLDER / "node_modules" / ".bin" / program
    return run(folder, find_program("node"), command.resolve(), *arguments, **variables)


def use_in_node(folder: Path, name: str, service: Service) -> dict[str, Any]:
    """Compiles the program that uses a generated client, and runs it; returns its report."""
    for source in (f"{name}.ts", "report.ts"):
        shutil.copy(FOLDER / source, folder)
    (folder / "node_modules").symlink_to(FOLDER / "node_modules")
    project = {"compilerOptions": OPTIONS, "include": ["**/*.ts"], "exclude": ["node_modules"]}
    (folder / "tsconfig.json").write_text(json.dumps(project), encoding="utf-8")
    run_package(folder, "tsc")
    bundle = run(
        folder,
        FOLDER / "node_modules" / ".bin" / "esbuild",
        f"{name}.ts",
        "--bundle",
        "--format=esm",
        "--outfile=program.mjs",
        f"--define:SERVICE_URL={json.dumps(service.url)}",
        f"--define:SERVICE_KEY={json.dumps(service.key)}",
    )
    assert "warning" not in bundle, bundle
    report: dict[str, Any] = json.loads(run(folder, find_program("node"), "program.mjs"))
    return report


def test_linters_find_no_errors(document: Path) -> None:
    folder = document.parent
    lint = run_package(folder, "redocly", "lint", document.name)
    assert "Your API description is valid" in lint
    rules = FOLDER / "spectral.yaml"
    run_package(folder, "spectral", "lint", document.name, "--ruleset", rules)


def test_openapi_fetch(service: Service, tmp_path: Path) -> None:
    url = f"{service.url}/openapi.json"
    # Without the first option, every field with a default would be required, also in requests.
    options = ("--default-non-nullable=false", "--root-types", "--root-types-no-schema-prefix")
    run_package(tmp_path, "openapi-typescript", url, "-o", "generated.d.ts", *options)
    report = use_in_node(tmp_path, "openapi-fetch", service)
    assert report == RECEIVED | {"kind": "openapi-fetch", "magic": "glTF", "bytes": 2064}


def test_hey_api(service: Service, tmp_path: Path) -> None:
    run_package(tmp_path, "openapi-ts", "-i", f"{service.url}/openapi.json", "-o", "generated")
    report = use_in_node(tmp_path, "hey-api", service)
    assert report == RECEIVED | {"kind": "hey-api", "magic": "glTF", "bytes": 2064}


def test_orval(service: Service, tmp_path: Path) -> None:
    shutil.copy(FOLDER / "orval.config.js", tmp_path / "orval.config.mjs")
    run_package(tmp_path, "orval", "--config", "orval.config.mjs", SERVICE=service.url)
    report = use_in_node(tmp_path, "orval", service)
    assert report == RECEIVED | {"kind": "orval", "magic": "glTF", "bytes": 2064}


def test_openapi_python_client(service: Service, tmp_path: Path) -> None:
    url, program = f"{service.url}/openapi.json", PYTHON.with_name("openapi-python-client")
    run(tmp_path, program, "generate", "--url", url, "--output-path", "client", "--meta", "none")
    shutil.copy(FOLDER / "use_python_client.py", tmp_path)
    report = json.loads(run(tmp_path, PYTHON, "use_python_client.py", *service))
    assert report == RECEIVED | {"kind": "openapi-python-client"}


def test_models_of_datamodel_code_generator_accept_every_example(
    document: Path, tmp_path: Path
) -> None:
    options = ("--input-file-type", "openapi", "--output-model-type", "pydantic_v2.BaseModel")
    program = PYTHON.with_name("datamodel-codegen")
    run(tmp_path, program, "--input", document, "--output", "models.py", *options)
    shutil.copy(FOLDER / "use_models.py", tmp_path)
    *refused, count = run(tmp_path, PYTHON, "use_models.py", document).splitlines()
    assert refused == []
    assert int(count) > 300
