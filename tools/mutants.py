"""Puts small faults (mutants) into the code, one at a time, and runs the tests of the same folder.

    python -m tools.mutants FILE [--seed 1] [--count 65] [--checkout DIR] [--limit 900]

If FILE does not exist, the program draws COUNT random mutants of DIR (by default this checkout), an
equal number from each of five rooms, and writes them to FILE. If FILE exists, the program reads it,
and finds the mutants in DIR by their lines of code. So the tests of two checkouts can judge the
same mutants. A verdict is `killed` (a test fails), `survived`, `slow` (the tests take more than
LIMIT seconds; counts as killed) or `gone` (DIR does not have this line). The program prints the
verdicts and writes them beside FILE: for `faults.json` and the folder `main`, to
`faults.main.json`.
"""

import argparse
import ast
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

ROOMS = ("engine", "surface", "encoders", "schemas", "api")
COMPARISONS: dict[type, type[ast.cmpop]] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
OPERATORS: dict[type, type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Add, ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.MatMult: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """One fault: at `column` (in bytes) of `line`, the text `before` is replaced by `after`.

    `code` is the text of the line, by which the line is found in another checkout; `nth` is the
    number of equal lines before it.
    """

    path: str
    line: int
    code: str
    nth: int
    column: int
    kind: str
    before: str
    after: str


def _list_faults(node: ast.AST) -> Iterator[tuple[str, ast.AST, str]]:
    """The faults at a node: their kind, the part of the node that is replaced, and its new text."""
    match node:
        case ast.Compare(left=left, ops=[op, *other_operators], comparators=comparators) if (
            type(op) in COMPARISONS
        ):
            comparison = ast.Compare(left, [COMPARISONS[type(op)](), *other_operators], comparators)
            yield "comparison", node, f"({ast.unparse(comparison)})"
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            operation = ast.BinOp(left, OPERATORS[type(op)](), right)
            yield "operator", node, f"({ast.unparse(operation)})"
        case ast.Constant(value=int() as value):
            yield "constant", node, str(not value if isinstance(value, bool) else value + 1)
        case ast.BoolOp(op=op, values=values):
            combination = ast.BoolOp(ast.Or() if isinstance(op, ast.And) else ast.And(), values)
            yield "and-or", node, f"({ast.unparse(combination)})"
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            yield "sign", node, f"({ast.unparse(operand)})"
        case ast.If(test=test) | ast.IfExp(test=test) | ast.While(test=test):
            yield "condition", test, f"(not ({ast.unparse(test)}))"
        case ast.Return(value=ast.expr()):
            yield "return", node, "return None"
        case ast.Call(func=func, args=[first, second, *other_arguments], keywords=keywords):
            call = ast.Call(func, [second, first, *other_arguments], keywords)
            yield "arguments", node, f"({ast.unparse(call)})"
        case ast.Expr(value=ast.Call()) | ast.AugAssign() | ast.Raise():
            yield "deletion", node, "pass"


def _list_parts(node: ast.AST) -> Iterator[ast.AST]:
    """A node and its descendants, except type annotations and the parts of f-strings."""
    yield node
    for name, value in ast.iter_fields(node):
        if name not in {"annotation", "returns"} and not isinstance(node, ast.JoinedStr):
            for each in value if isinstance(value, list) else [value]:
                if isinstance(each, ast.AST):
                    yield from _list_parts(each)


def list_mutants(root: Path, path: Path) -> Iterator[Mutant]:
    """All mutants of one file."""
    source = path.read_text(encoding="utf-8")
    lines = source.splitlines()
    for node in _list_parts(ast.parse(source)):
        for kind, part, after in _list_faults(node):
            before = ast.get_source_segment(source, part)
            if before is not None:
                line, column = part.lineno, part.col_offset  # type: ignore[attr-defined]
                code, name = lines[line - 1], str(path.relative_to(root))
                nth = lines[: line - 1].count(code)
                yield Mutant(name, line, code, nth, column, kind, before, after)


def draw_mutants(root: Path, seed: int, count: int) -> list[Mutant]:
    """Random mutants, an equal number from each room; in a room, the kinds of fault alternate."""
    sample = []
    for room in ROOMS:
        random_numbers = random.Random(f"{seed} {room}")
        kinds: dict[str, list[Mutant]] = {}
        for path in sorted((root / "service" / room).rglob("*.py")):
            for mutant in list_mutants(root, path):
                kinds.setdefault(mutant.kind, []).append(mutant)
        for turn in range(count // len(ROOMS)):
            candidates = kinds[sorted(kinds)[turn % len(kinds)]]
            sample.append(candidates.pop(random_numbers.randrange(len(candidates))))
    return sample


def apply_mutant(source: str, mutant: Mutant) -> str | None:
    """The text of the file with the fault, or None if the file does not have the line any more."""
    lines = source.splitlines(keepends=True)
    equal_lines = [k for k, line in enumerate(lines) if line.rstrip("\r\n") == mutant.code]
    if len(equal_lines) <= mutant.nth:
        return None
    start = equal_lines[mutant.nth]
    text_from_line = "".join(lines[start:]).encode()
    end = mutant.column + len(mutant.before.encode())
    if text_from_line[mutant.column : end].decode() != mutant.before:
        return None
    mutated_text = text_from_line[: mutant.column] + mutant.after.encode() + text_from_line[end:]
    return "".join(lines[:start]) + mutated_text.decode()


def list_tests(copy: Path, path: str) -> list[str]:
    """Tests of a module, the nearest first: of the module itself, of its folder, of its room."""
    room, *folders, name = Path(path).with_suffix("").parts[1:]
    folder = Path("tests", room, *folders)
    paths = [folder / f"test_{name}.py", folder, Path("tests", room)]
    paths += [Path("tests", "test_openapi.py")] * (room == "api")
    return [str(each) for each in paths if (copy / each).exists()]


def judge_mutant(copy: Path, mutant: Mutant, limit: float) -> tuple[str, str]:
    """The verdict, and the test that failed. A test that fails, but passes when it is run again,
    does not count."""
    path = copy / mutant.path
    source = path.read_text(encoding="utf-8") if path.exists() else ""
    if (text := apply_mutant(source, mutant)) is None:
        return "gone", ""
    command = [sys.executable, "-B", "-m", "pytest", "-x", "-q", *list_tests(copy, mutant.path)]
    environment = os.environ | {"PYTHONPATH": str(copy)}
    path.write_text(text, encoding="utf-8")
    failure = ""
    try:
        for extra_options in ([], ["--last-failed"]):
            run = subprocess.run(
                [*command, *extra_options], cwd=copy, env=environment, timeout=limit, text=True,
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
            )  # fmt: skip
            if run.returncode == 0:
                return "survived", failure
            failure = next((x for x in run.stdout.splitlines() if x.startswith("FAILED")), "error")
    except subprocess.TimeoutExpired:
        return "slow", ""
    finally:
        path.write_text(source, encoding="utf-8")
    return "killed", failure


def main() -> None:
    """Draws or reads the mutants, judges each, and prints the verdicts and their numbers."""
    parser = argparse.ArgumentParser(prog="tools.mutants", description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--checkout", type=Path, default=Path())
    for flag, default in (("--seed", 1), ("--count", 65), ("--limit", 900)):
        parser.add_argument(flag, type=int, default=default)
    options = parser.parse_args()
    root = options.checkout.resolve()
    if not options.file.exists():
        mutants = draw_mutants(root, options.seed, options.count)
        text = json.dumps([asdict(mutant) for mutant in mutants])
        options.file.write_text(text, encoding="utf-8")
    sample = [Mutant(**each) for each in json.loads(options.file.read_text(encoding="utf-8"))]
    verdicts = []
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / root.name
        shutil.copytree(root, copy, ignore=shutil.ignore_patterns(".*", "node_modules", "build"))
        if (modules := root / "tests" / "web" / "node_modules").exists():
            (copy / "tests" / "web" / "node_modules").symlink_to(modules)
        for mutant in sample:
            verdict, failed_test = judge_mutant(copy, mutant, options.limit)
            verdicts.append(asdict(mutant) | {"verdict": verdict, "by": failed_test})
            print(
                verdict,
                mutant.kind,
                mutant.path,
                mutant.line,
                mutant.after[:60],
                failed_test,
                flush=True,
            )
    options.file.with_suffix(f".{root.name}.json").write_text(json.dumps(verdicts, indent=1))
    for room in (*ROOMS, ""):
        counts = Counter(v["verdict"] for v in verdicts if v["path"].startswith(f"service/{room}"))
        total = sum(counts.values()) - counts["gone"]
        noticed_count = counts["killed"] + counts["slow"]
        print(f"{room or 'all':9} {noticed_count} of {total} noticed, {counts['gone']} gone")


if __name__ == "__main__":
    main()
