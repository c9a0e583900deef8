"""CAD files on the command line, read by this process or by a service; the report of reading."""

import json
from pathlib import Path

import pytest

from service.cli.main import main
from service.cli.reading import print_counts, print_reading
from tests.cad import ASSEMBLY, IFC, OPEN_TETRAHEDRON, TETRAHEDRON
from tools.cad_files.sheets import write_sheets


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A folder with CAD files."""
    contents = {
        "part.step": TETRAHEDRON,
        "open.STP": OPEN_TETRAHEDRON,
        "assembly.p21": ASSEMBLY,
        "part.txt": TETRAHEDRON,
        "model.step": IFC,
        "loft.brep": b"DBRep_DrawableShape",
        "bad.step": b"ISO-10303-21;",
    }
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
    return tmp_path


COMMANDS = [
    ["mesh", "part.step", "--format", "glb"],
    ["mesh", "open.STP", "--format", "stl", "--tolerance", "0.1", "--name", "wedge"],
    ["mesh", "assembly.p21", "--format", "off", "--relative-tolerance", "0.01", "--up", "y"],
    ["mesh", "part.txt", "--format", "obj", "--input-format", "step"],
    ["estimate", "assembly.p21", "--format", "glb", "--tolerance", "0.01"],
    ["convert", "open.STP", "--invalid-faces", "refuse"],
    ["convert", "part.step", "--untrim", "2"],
    ["points", "part.step", "--patch", "2", "--uv", "0.25,0.25"],
    ["project", "part.step", "--point", "0.1,0.1,0.1", "--point", "5,5,5", "--sign"],
    ["project", "open.STP", "--point", "0,0,9", "--invalid-faces", "refuse", "--up", "y"],
    ["intersect", "assembly.p21", "--ray", "0.1,0.1,9,0,0,-1", "--all"],
    ["measure", "part.step", "--tolerance", "1e-3"],
    ["section", "part.step", "--normal", "0,0,1", "--offsets", "1", "--format", "json"],
]


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_local_and_remote_results_are_equal(
    server: str, files: Path, capsys: pytest.CaptureFixture[str], command: list[str]
) -> None:
    name, source, *flags = command
    results = []
    for number, url_flags in enumerate(([], ["--url", server])):
        output = files / f"{number}.out"
        assert main([name, str(files / source), *flags, *url_flags, "-o", str(output)]) == 0
        results.append(output.read_bytes())
    assert results[0] == results[1]
    assert source in capsys.readouterr().err


def test_a_call_that_reads_no_files_gets_the_document_of_a_long_file(
    server: str, files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    long = files / "sheets.step"
    long.write_bytes(write_sheets(70_000))
    results = []
    for flags in ([], ["--url", server]):
        assert main(["points", str(long), "--patch", "3", "--uv", "4,4", *flags, "-o", "-"]) == 0
        results.append(capsys.readouterr().out)
    assert results[0] == results[1]


def test_the_report_names_what_is_not_in_the_surface(
    server: str, files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, output = str(files / "open.STP"), str(files / "open.json")
    assert main(["convert", source, "-o", output]) == 0
    local = capsys.readouterr().err
    lines = local.splitlines()
    assert lines[0].startswith(f"surface: {source}: STEP, AUTOMOTIVE_DESIGN, in centimetre: ")
    assert lines[0].endswith(" 3 faces")
    assert lines[1] == f"surface: {source}: 1 face is not in the surface:"
    assert lines[2].startswith(f"surface: {source}:   #57: ")
    reading = json.loads(Path(output).read_bytes())["reading"]
    assert lines[2].endswith(reading["skipped_faces"][0]["reason"])
    assert main(["convert", source, "-o", output, "--url", server]) == 0
    assert capsys.readouterr().err == local
    assert main(["mesh", source, "-o", str(files / "open.glb"), "--url", server]) == 0
    assert capsys.readouterr().err == (
        f"surface: {source}: 3 faces; 1 face is not in the surface, and `surface convert` says "
        "which and why\n"
    )


def test_store_prints_the_report_and_the_urls(
    server: str, files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["store", str(files / "part.step"), "--url", server]) == 0
    captured = capsys.readouterr()
    assert "4 faces" in captured.err
    id = captured.out.split()[1]
    document = files / "document.json"
    assert main(["convert", str(files / "part.step"), "-o", str(document)]) == 0
    assert main(["store", str(document), "--url", server]) == 0
    assert capsys.readouterr().out.split()[1] == id


REFUSALS = [
    (["mesh", "loft.brep"], 1, "The service does not read files of Open CASCADE (BREP)."),
    (["mesh", "part.step", "--degree", "3"], 2, "--degree: This file says itself"),
    (["mesh", "part.step", "--invalid-faces", "keep"], 1, "--invalid-faces: The value is not"),
    (["mesh", "assembly.p21", "--up", "x"], 1, "--up: The value is not"),
    (["mesh", "part.step", "--resolution", "3"], 1, "--resolution: A brep is meshed by tolerance"),
    (["convert", "part.step", "--untrim", "9"], 1, "--untrim: "),
    (["mesh", "part.txt", "--input-format", "json"], 1, "The text is not JSON"),
    (["mesh", "missing.step"], 2, "no such file"),
    (["mesh", "part.step", "--input-format", "x"], 2, "--input-format: unknown; needed one of"),
]


@pytest.mark.parametrize("number", range(len(REFUSALS)), ids=lambda k: " ".join(REFUSALS[k][0]))
def test_errors_name_the_flag_or_what_to_export(
    server: str, files: Path, capsys: pytest.CaptureFixture[str], number: int
) -> None:
    (name, source, *flags), code, text = REFUSALS[number]
    format_flags = ["--format", "glb"] if name == "mesh" else []
    for url_flags in ([], ["--url", server]):
        command = [name, str(files / source), *flags, *format_flags, *url_flags, "-o", "-"]
        assert main(command) == code
        lines = capsys.readouterr().err.splitlines()
        assert lines[-1].startswith(f"surface: {text}")


def test_a_file_of_another_format_is_named_by_its_content(
    server: str, files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for url_flags in ([], ["--url", server]):
        command = ["mesh", str(files / "model.step"), *url_flags, "-o", "x.glb"]
        assert main(command) == 1
        assert "Industry Foundation Classes (IFC)" in capsys.readouterr().err


def test_a_damaged_file_is_refused(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", str(files / "bad.step"), "-o", "x.json"]) == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_flags_for_cad_files_are_refused_for_other_files(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["mesh", "saddle", "-o", "x.glb", "--invalid-faces", "skip"]) == 2
    text = "surface: --invalid-faces: only for files of control points and CAD files"
    assert capsys.readouterr().err.startswith(text)


def test_the_name_of_a_format_is_not_repeated(capsys: pytest.CaptureFixture[str]) -> None:
    reading = {"format": "iges", "schema": "IGES 5.3", "products": 1, "faces": 6, "open_edges": 4}
    print_reading("part.igs", reading)
    assert capsys.readouterr().err.splitlines() == [
        "surface: part.igs: IGES 5.3: 1 product, 6 faces",
        "surface: part.igs: 4 edges of only one face",
    ]


def test_the_report_is_complete_and_short(capsys: pytest.CaptureFixture[str]) -> None:
    reading = {
        "format": "step",
        "schema": "CONFIG_CONTROL_DESIGN",
        "system": "a system",
        "units": ["inch", "millimetre"],
        "products": 3,
        "solids": 1,
        "open_shells": 0,
        "faces": 7,
        "skipped_entities": {"GEOMETRIC_SET": 2, "TESSELLATED_SOLID": 1},
        "skipped_faces": [{"entity": f"#{k}", "reason": "no surface"} for k in range(30)],
        "uncertainty": 0.01,
        "changed_names": 1,
        "edge_gap": 0.001,
        "vertex_gap": 0.25,
        "unfollowed_references": 2,
    }
    print_reading("a.step", reading)
    lines = [
        line.removeprefix("surface: a.step: ") for line in capsys.readouterr().err.splitlines()
    ]
    assert lines[0] == (
        "STEP, CONFIG_CONTROL_DESIGN, written by a system, in inch, millimetre: 3 products, "
        "1 solid, 7 faces"
    )
    assert lines[1] == "30 faces are not in the surface:"
    assert lines[2] == "  #0: no surface"
    print_reading("a.step", reading | {"uncertainty": 0.3})
    assert "gaps" not in capsys.readouterr().err
    assert lines[22:] == [
        "  and 10 more, which `surface convert` lists",
        "not read: 2 GEOMETRIC_SET, 1 TESSELLATED_SOLID",
        "1 name shortened or cleaned",
        "2 references to other files not followed",
        "largest gaps: 0.001 from edge to surface, 0.25 from vertex to edge",
    ]


@pytest.mark.parametrize("header", ["", "faces", "faces=x; skipped=1", "faces=1"])
def test_a_header_of_another_form_prints_nothing(
    header: str, capsys: pytest.CaptureFixture[str]
) -> None:
    print_counts("a.step", header)
    assert capsys.readouterr().err == ""
