"""Makes the package of the TypeScript client, and runs programs that import it on Node."""

import json
import subprocess
import tarfile
from pathlib import Path
from typing import Any

from tests.web.compiler import STRICT, compile_project
from tools.programs import find_node_package, find_program

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "clients" / "typescript"
PAGE = ROOT / "docs" / "typescript.md"


def install_package(folder: Path) -> Path:
    """The folder of the package, which is packed by npm and unpacked below `node_modules`.

    `folder` then also has `three`, and programs in it may import both.
    """
    find_node_package("typescript-7")
    built = folder / "built"
    command = [find_program("node"), str(SOURCES / "build.js"), str(built)]
    subprocess.run(command, check=True, timeout=120)
    pack = [find_program("npm"), "pack", "--silent", "--pack-destination", str(folder), str(built)]
    subprocess.run(pack, check=True, timeout=120, stdout=subprocess.DEVNULL)
    (archive,) = folder.glob("*.tgz")
    modules = folder / "node_modules"
    modules.mkdir()
    with tarfile.open(archive) as file:
        file.extractall(modules, filter="data")
    (modules / "three").symlink_to(find_node_package("three"))
    (modules / "@types").symlink_to(find_node_package("@types/three").parent)
    (folder / "package.json").write_text('{"type": "module"}', encoding="utf-8")
    return (modules / "package").rename(modules / "surface-service")


def run_program(folder: Path, program: str, *arguments: str) -> str:
    """The output of a program in JavaScript, which may import the package in this folder."""
    file = folder / "program.js"
    file.write_text(program, encoding="utf-8")
    process = subprocess.run(
        [find_program("node"), str(file), *arguments],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    return process.stdout


def evaluate(folder: Path, body: str, argument: Any = None) -> Any:
    """The value that the body of an async function returns, on Node.

    The body has all names of the package, and `argument`. Both values are JSON.
    """
    program = f"""import * as all from 'surface-service';
        const AsyncFunction = (async () => {{}}).constructor;
        const names = Object.keys(all);
        const run = new AsyncFunction(...names, 'argument', {json.dumps(body)});
        const value = await run(...Object.values(all), {json.dumps(argument)});
        process.stdout.write(JSON.stringify(value ?? null));"""
    return json.loads(run_program(folder, program))


def compile_program(folder: Path, program: str, **options: Any) -> tuple[str, str]:
    """The errors of the strict compiler, and the program in JavaScript.

    `options` are further options of the compiler.
    """
    (folder / "program.ts").write_text(program, encoding="utf-8")
    project = folder / "tsconfig.json"
    settings = STRICT | {"outDir": "js"} | options
    document = {"compilerOptions": settings, "files": ["program.ts"]}
    project.write_text(json.dumps(document), encoding="utf-8")
    errors = compile_project(project)
    return errors, (folder / "js" / "program.js").read_text(encoding="utf-8")
