"""Writes the bill of materials of the service as CycloneDX JSON: `make sbom`.

    python -m tools.supply.sbom PYTHON OUTPUT

PYTHON is a Python in which only the service is installed. The program cyclonedx-py lists its
packages; this program adds the npm packages of the pages, and validates the bill by the schema. The
bill has no time and no random number, so the same packages give the same bytes.
"""

import base64
import importlib
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from service import __version__
from tools.supply.packages import ROOT, Script, list_scripts

SPECIFICATION = "1.6"


def list_python_packages(python: str) -> dict[str, Any]:
    """The bill of the installed Python packages, with the service as main component."""
    command = [
        sys.executable, "-m", "cyclonedx_py", "environment", "--output-reproducible",
        "--spec-version", SPECIFICATION, "--output-format", "JSON",
        "--pyproject", str(ROOT / "pyproject.toml"), python,
    ]  # fmt: skip
    result = subprocess.run(command, stdout=subprocess.PIPE, check=True)
    bill: dict[str, Any] = json.loads(result.stdout)
    return bill


def build_component(script: Script) -> dict[str, Any]:
    """The CycloneDX component of an npm package, with its checksum from the lock file."""
    algorithm, _, checksum = script.integrity.partition("-")
    return {
        "type": "library",
        "bom-ref": f"pkg:npm/{script.name}@{script.version}",
        "purl": f"pkg:npm/{script.name}@{script.version}",
        "name": script.name,
        "version": script.version,
        "licenses": [{"license": {"id": script.licence, "acknowledgement": "declared"}}],
        "hashes": [{"alg": f"SHA-{algorithm[3:]}", "content": base64.b64decode(checksum).hex()}],
    }


def add_scripts(bill: dict[str, Any]) -> dict[str, Any]:
    """The bill with the npm packages of the pages, and with the version of the service.

    cyclonedx-py does not know the version, because it is not in pyproject.toml.
    """
    main = {**bill["metadata"]["component"], "version": __version__}
    main_ref = main["bom-ref"]
    components = [build_component(script) for script in list_scripts()]
    needs = {each["ref"]: each.get("dependsOn", []) for each in bill["dependencies"]}
    needs[main_ref] = [*needs.get(main_ref, []), *(each["bom-ref"] for each in components)]
    needs |= {each["bom-ref"]: [] for each in components}
    return {
        **bill,
        "metadata": {**bill["metadata"], "component": main},
        "components": sorted(
            [*bill["components"], *components], key=lambda each: str(each["bom-ref"])
        ),
        "dependencies": [
            {"ref": ref, **({"dependsOn": sorted(on)} if on else {})}
            for ref, on in sorted(needs.items())
        ],
    }


def main(python: str, output: str) -> None:
    """Writes the bill, if it is valid by its schema."""
    # This program runs in a Python of its own. The Python of the tests does not have these modules.
    validation = importlib.import_module("cyclonedx.validation.json")
    version = importlib.import_module("cyclonedx.schema").SchemaVersion.V1_6
    text = json.dumps(add_scripts(list_python_packages(python)), indent=2, sort_keys=True) + "\n"
    if problem := validation.JsonStrictValidator(version).validate_str(text):
        sys.exit(f"not CycloneDX {SPECIFICATION}: {problem}")
    Path(output).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
