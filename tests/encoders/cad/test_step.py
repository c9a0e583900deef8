"""STEP: an exchange structure with the topology, names, colours and instances of the model."""

from collections import Counter
from math import cos, sin
from typing import Any

import numpy as np
import pytest

from oracles.solids import read_solid
from service.encoders.cad.assembly import assemble
from service.encoders.cad.bounds import bound_step, estimate_bytes
from service.encoders.cad.format import WrittenFile
from service.encoders.cad.step import encode
from service.errors import InvalidRequest, Issue, TooLarge
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from service.surface.brep_model import BrepModel
from service.surface.examples.catalogue import EXAMPLES, find
from service.surface.lowered import GroupModel
from service.surface.sizes import SurfaceKind
from tests.encoders.cad.part21 import Record, Reference, read
from tests.encoders.cad.part21 import find as find_records

SOLIDS = ["box", "cone", "sphere", "torus", "shelled", "gear", "pipe"]
WRITTEN = [name for name, each in EXAMPLES.items() if not each.surface().size().curves]


def read_surface(document: dict[str, Any]) -> SurfaceKind:
    return validate_document(MeshRequest, {"surface": document}).to_surface()


def allow_any(_: int) -> None:
    pass


def write(document: dict[str, Any]) -> tuple[dict[int, Record], WrittenFile]:
    """The instances of the file of a surface, and the file."""
    surface = read_surface(document)
    file = encode(surface.lower(), surface.unit, allow_any)
    return read(bytes(file.content)), file


def list_references(value: Any) -> list[int]:
    if isinstance(value, Reference):
        return [value.number]
    if isinstance(value, list | tuple):
        return [number for each in value for number in list_references(each)]
    return []


def check_structure(records: dict[int, Record]) -> None:
    """All references lead to records before, and every closed shell is closed by its topology."""
    for number, record in records.items():
        for values in record.parts.values():
            assert all(1 <= other < number for other in list_references(values))
    for shell in find_records(records, "CLOSED_SHELL"):
        uses: Counter[tuple[int, bool]] = Counter()
        for face in list_references(shell.values[1]):
            _, bounds, _, sense = records[face].values
            for bound in list_references(bounds):
                _, loop, is_same = records[bound].values
                assert is_same == sense
                for oriented in list_references(records[loop.number].values[1]):
                    *_, edge, orientation = records[oriented].values
                    uses[edge.number, (orientation == ".T.") == (is_same == ".T.")] += 1
        assert set(uses.values()) == {1}
        assert {edge for edge, _ in uses} == {edge for edge, way in uses if way}
        assert all((edge, not way) in uses for edge, way in uses)


def check_loops(records: dict[int, Record]) -> None:
    """In every loop an edge ends where the next begins."""
    for loop in find_records(records, "EDGE_LOOP"):
        ends = []
        for oriented in list_references(loop.values[1]):
            *_, edge, orientation = records[oriented].values
            _, first, last, _, sense = records[edge.number].values
            assert sense == ".T."
            pair = first.number, last.number
            ends.append(pair if orientation == ".T." else pair[::-1])
        for (_, last), (first, _) in zip(ends, ends[1:] + ends[:1], strict=True):
            assert last == first


@pytest.mark.slow
@pytest.mark.parametrize("name", WRITTEN)
def test_files_of_examples_are_sound(name: str) -> None:
    surface = find(name).surface()
    bounds: list[int] = []
    file = encode(surface.lower(), None, bounds.append)
    content = bytes(file.content)
    records = read(content)
    check_structure(records)
    check_loops(records)
    assert len(content) <= bounds[0]
    assert bounds[0] <= 40 * len(content) + 10_000
    assert len(content) <= estimate_bytes(surface.size())
    assert len(find_records(records, "ADVANCED_FACE")) == file.report.faces
    assert bytes(encode(surface.lower(), None, allow_any).content) == content


@pytest.mark.parametrize("name", SOLIDS)
def test_files_of_solids_are_sound(name: str) -> None:
    records, file = write(read_solid(name))
    check_structure(records)
    check_loops(records)
    kind = "SHELL_BASED_SURFACE_MODEL" if name == "shelled" else "MANIFOLD_SOLID_BREP"
    assert len(find_records(records, kind)) == 1
    assert len(find_records(records, "ADVANCED_FACE")) == file.report.faces


def test_solids_with_voids() -> None:
    document = read_solid("shelled")
    for shell in document["shells"]:
        shell["closed"] = True
    records, _ = write(document)
    check_structure(records)
    (solid,) = find_records(records, "BREP_WITH_VOIDS")
    outer, voids = solid.values[1:]
    assert records[outer.number].kind == "CLOSED_SHELL"
    assert [records[each.number].kind for each in voids] == ["ORIENTED_CLOSED_SHELL"]


def place(x: float, angle: float = 0.0) -> list[list[float]]:
    c, s = cos(angle), sin(angle)
    return [[c, -s, 0, x], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]


BOLT = "bolt Größe 5; '1' \\ 😀"


def make_group(*members: dict[str, Any]) -> dict[str, Any]:
    return {"type": "group", "up": "z", "name": "assembly", "members": list(members)}


def test_equal_members_are_instances_of_one_product() -> None:
    bolt = read_solid("bolt") | {"name": BOLT}
    group = make_group(
        {"name": "left", "surface": bolt},
        {"name": "right", "surface": bolt, "matrix": place(50, 0.7)},
    )
    records, file = write(group)
    check_structure(records)
    assert [p.values[1] for p in find_records(records, "PRODUCT")] == [BOLT, "assembly"]
    usages = find_records(records, "NEXT_ASSEMBLY_USAGE_OCCURRENCE")
    assert [usage.values[1] for usage in usages] == ["left", "right"]
    assert len({usage.values[4].number for usage in usages}) == 1
    assert len(find_records(records, "MANIFOLD_SOLID_BREP")) == 1
    assert (file.report.definitions, file.report.instances) == (1, 2)
    moves = find_records(records, "ITEM_DEFINED_TRANSFORMATION")
    _, point, axis, along = records[moves[1].values[3].number].values
    assert records[point.number].values[1] == [50.0, 0.0, 0.0]
    assert records[axis.number].values[1] == [0.0, 0.0, 1.0]
    assert records[along.number].values[1] == pytest.approx([cos(0.7), sin(0.7), 0.0], abs=1e-15)


def test_mirrored_members_are_one_mirrored_body_placed_by_rotations() -> None:
    """Three mirrors: bodies differ by rotations only, so that one mirrored body is enough."""
    bolt = read_solid("bolt")
    mirrors = [np.diag([-1.0, 1.0, 1.0, 1.0]).tolist()]
    mirrors.append((np.array(place(9, 0.3)) @ np.diag([1.0, -1.0, 1.0, 1.0])).tolist())
    mirrors.append((np.array(place(3, 1.3)) @ np.diag([1.0, 1.0, -1.0, 1.0])).tolist())
    group = make_group(
        *({"name": f"m{k}", "surface": bolt, "matrix": m} for k, m in enumerate(mirrors))
    )
    assembly = assemble(read_surface(group).lower())
    assert len(assembly.definitions) == 1
    (body,) = assembly.definitions[0].transformed_bodies()
    (plain,) = assembly.definitions[0].bodies
    assert np.array_equal(body.is_reversed, ~plain.is_reversed)
    for instance, matrix in zip(assembly.instances, mirrors, strict=True):
        assert instance.matrix is not None
        linear = instance.matrix[:3, :3]
        assert np.allclose(linear @ linear.T, np.eye(3), atol=1e-15)
        assert np.linalg.det(linear) > 0
        placed = body.vertices @ linear.T + instance.matrix[:3, 3]
        expected = plain.vertices @ np.array(matrix)[:3, :3].T + np.array(matrix)[:3, 3]
        assert np.allclose(placed, expected, atol=1e-13)
    records, _ = write(group)
    check_structure(records)
    assert len(find_records(records, "MANIFOLD_SOLID_BREP")) == 1


def test_scaled_and_sheared_members_are_bodies_of_their_own() -> None:
    box = read_solid("box")
    sheared = [[1, 0.5, 0, 7], [0, 1, 0, 0], [0, 0, 3, 0], [0, 0, 0, 1]]
    group = make_group({"surface": box}, {"surface": box, "matrix": sheared})
    records, file = write(group)
    check_structure(records)
    assert file.report.definitions == 2
    assembly = assemble(read_surface(group).lower())
    (body,) = assembly.definitions[1].transformed_bodies()
    (plain,) = assembly.definitions[0].bodies
    matrix = assembly.instances[1].matrix
    assert matrix is not None
    expected = plain.vertices @ np.array(sheared)[:3, :3].T + [7, 0, 0]
    placed = body.vertices @ matrix[:3, :3].T + matrix[:3, 3]
    assert np.allclose(placed, expected, atol=1e-12)


def find_styles(records: dict[int, Record]) -> list[tuple[str, list[float], float | None]]:
    """The kind of each styled item, its colour, and its transparency."""
    styles = []
    for item in find_records(records, "STYLED_ITEM"):
        waiting = list_references(item.values[1])
        color: list[float] = []
        clear = None
        while waiting:
            record = records[waiting.pop()]
            if record.kind == "COLOUR_RGB":
                color = record.values[1:]
            elif record.kind == "SURFACE_STYLE_TRANSPARENT":
                clear = record.values[0]
            waiting += list_references(record.values)
        styles.append((records[item.values[2].number].kind, color, clear))
    return styles


def test_colours_of_faces_and_members() -> None:
    box = read_solid("box")
    box["faces"][2]["color"] = [1, 1, 0]
    group = make_group(
        {"surface": box, "color": [0.2, 0.4, 0.8]},
        {"surface": box, "color": [1, 0, 0, 0.25], "matrix": place(40)},
        {"surface": box, "color": [1, 0, 0, 0.25], "matrix": place(80)},
    )
    records, file = write(group)
    assert file.report.definitions == 2
    yellow = ("ADVANCED_FACE", [1.0, 1.0, 0.0], None)
    assert find_styles(records) == [
        yellow,
        ("MANIFOLD_SOLID_BREP", [0.2, 0.4, 0.8], None),
        yellow,
        ("MANIFOLD_SOLID_BREP", [1.0, 0.0, 0.0], 0.75),
    ]
    assert len(find_records(records, "COLOUR_RGB")) == 3


def test_names_of_faces() -> None:
    box = read_solid("box")
    box["faces"][0]["name"] = BOLT
    records, _ = write(box)
    names = [face.values[0] for face in find_records(records, "ADVANCED_FACE")]
    assert names[0] == BOLT


def test_models_without_a_unit_are_millimetres_and_the_head_says_so() -> None:
    records, file = write(read_solid("box"))
    (unit,) = find_records(records, "LENGTH_UNIT")
    assert unit.parts["SI_UNIT"] == [".MILLI.", ".METRE."]
    assert b"One unit of the model is written as 1 mm" in bytes(file.content)[:400]
    assert file.report.is_unit_assumed


@pytest.mark.parametrize(
    ("metres", "prefix"), [(0.001, ".MILLI."), (1.0, "$"), (0.01, ".CENTI."), (1e-6, ".MICRO.")]
)
def test_units_of_the_metre(metres: float, prefix: str) -> None:
    records, file = write(read_solid("box") | {"metres_per_unit": metres})
    (unit,) = find_records(records, "LENGTH_UNIT")
    assert unit.parts["SI_UNIT"] == [prefix, ".METRE."]
    assert not file.report.is_unit_assumed
    assert b"1 mm" not in bytes(file.content)[:400]


@pytest.mark.parametrize(
    ("metres", "name"), [(0.0254, "INCH"), (25.4 * 0.001, "INCH"), (0.3048, "FOOT"), (0.37, "UNIT")]
)
def test_other_units_are_conversions(metres: float, name: str) -> None:
    records, _ = write(read_solid("box") | {"metres_per_unit": metres})
    (unit,) = find_records(records, "CONVERSION_BASED_UNIT")
    title, factor = unit.parts["CONVERSION_BASED_UNIT"]
    assert title == name
    measure, base = records[factor.number].values
    assert measure == ("LENGTH_MEASURE", [pytest.approx(metres, rel=1e-15)])
    assert records[base.number].parts["SI_UNIT"] == ["$", ".METRE."]


def make_tree(matrix: list[list[float]]) -> dict[str, Any]:
    """Two equal assemblies of two bolts and a box; `matrix` places the second one."""
    members: list[dict[str, Any]] = []
    for number in range(2):
        frame = len(members)
        members.append({"name": f"frame {number}"} | ({"matrix": matrix} if number else {}))
        members += [
            {"name": "first", "parent": frame, "definition": 0, "matrix": place(10)},
            {"name": "second", "parent": frame, "definition": 0, "matrix": place(30, 0.5)},
            {"name": "third", "parent": frame, "definition": 1},
        ]
    definitions = [read_solid("bolt"), read_solid("box")]
    tree = {"type": "group", "up": "z", "name": "machine", "metres_per_unit": 0.0254}
    return tree | {"definitions": definitions, "members": members}


def test_equal_assemblies_in_a_tree_keep_their_structure() -> None:
    document = make_tree(place(100, 1.0))
    for member in document["members"]:
        if "parent" not in member:
            member["name"] = "frame"
    records, file = write(document)
    check_structure(records)
    names = [product.values[1] for product in find_records(records, "PRODUCT")]
    assert names == ["bolt", "box", "frame", "machine"]
    usages = [u.values[1] for u in find_records(records, "NEXT_ASSEMBLY_USAGE_OCCURRENCE")]
    assert usages == ["first", "second", "third", "frame", "frame"]
    assert (file.report.definitions, file.report.instances) == (2, 6)


def test_a_stretched_assembly_stretches_the_bodies_in_it() -> None:
    """The placement of a frame mirrors and scales: its bodies are written again."""
    matrix = (np.array(place(100, 1.0)) @ np.diag([2.0, -2.0, 2.0, 1.0])).tolist()
    surface = read_surface(make_tree(matrix))
    model = surface.lower()
    assembly = assemble(model, surface.unit)
    assert isinstance(model, GroupModel)
    assert len(assembly.definitions) == 4
    frames = [np.eye(4)]
    copies = iter(model.members)
    for instance in assembly.instances:
        matrix_of = np.eye(4) if instance.matrix is None else instance.matrix
        assert np.allclose(matrix_of[:3, :3] @ matrix_of[:3, :3].T, np.eye(3), atol=1e-14)
        assert np.linalg.det(matrix_of[:3, :3]) > 0
        frames.append(frames[instance.parent + 1] @ matrix_of)
        if instance.definition is None:
            continue
        copy = next(copies)
        plain = model.models[copy.model]
        assert isinstance(plain, BrepModel)
        (body,) = assembly.definitions[instance.definition].transformed_bodies()
        placed = body.vertices @ frames[-1][:3, :3].T + frames[-1][:3, 3]
        whole = np.eye(4) if copy.matrix is None else copy.matrix
        expected = plain.vertices @ whole[:3, :3].T + whole[:3, 3]
        assert np.allclose(placed, expected, atol=1e-11)


def test_planes_and_lines_are_written_as_such() -> None:
    records, _ = write(read_solid("box"))
    kinds = Counter(record.kind for record in records.values())
    assert (kinds["PLANE"], kinds["LINE"], kinds["PCURVE"]) == (6, 12, 0)
    for plane in find_records(records, "PLANE"):
        _, _, axis, along = records[plane.values[1].number].values
        z, x = (np.array(records[each.number].values[1]) for each in (axis, along))
        assert abs(z @ x) < 1e-15


def test_parameter_curves_have_the_parameters_of_their_edges() -> None:
    """Also where the edge is a line: then they run over its arc length."""
    records, _ = write(read_solid("cylinder"))
    assert find_records(records, "SEAM_CURVE")
    for edge in find_records(records, "EDGE_CURVE"):
        curve = records[edge.values[3].number]
        if curve.kind not in ("SURFACE_CURVE", "SEAM_CURVE"):
            continue
        _, space, pcurves, preference = curve.values
        assert preference == ".CURVE_3D."
        begin, end = find_range(records, space.number, edge)
        for pcurve in pcurves:
            _, _, placed = records[pcurve.number].values
            (line,) = list_references(records[placed.number].values[1])
            knots = find_knots(records[line])
            assert (knots[0], knots[-1]) == (begin, end)


def find_knots(curve: Record) -> list[float]:
    knots: list[float] = curve.parts["B_SPLINE_CURVE_WITH_KNOTS"][-2]
    return knots


def find_range(records: dict[int, Record], space: int, edge: Record) -> tuple[float, float]:
    """The parameters at which an edge begins and ends."""
    if records[space].kind != "LINE":
        knots = find_knots(records[space])
        return knots[0], knots[-1]
    first, last = (
        np.array(records[records[edge.values[k].number].values[1].number].values[1]) for k in (1, 2)
    )
    return 0.0, float(np.sqrt(np.square(last - first).sum()))


def test_small_numbers_have_a_point_before_the_exponent() -> None:
    net = [[[0, 0, 0], [0, 1e-9, 0]], [[1e22, 0, 0], [1e22, 2.5e-9, 1e-7]]]
    records, file = write({"type": "bezier", "control_net": net})
    points = [r.values[1] for r in find_records(records, "CARTESIAN_POINT")]
    assert [1e22, 2.5e-9, 1e-7] in points
    assert b"1.E-09" in bytes(file.content) or b"1.E-9" in bytes(file.content)


def test_tubes_are_refused() -> None:
    with pytest.raises(InvalidRequest) as caught:
        encode(find("trefoil-tube").surface().lower(), None, allow_any)
    assert caught.value.issues[0].code == "not_parametric"


def test_files_that_are_too_large_are_not_written() -> None:
    model = find("gear").surface().lower()

    def allow(byte_bound: int) -> None:
        raise TooLarge(Issue("too_many_bytes", "", "", str(byte_bound)))

    with pytest.raises(TooLarge) as caught:
        encode(model, None, allow)
    assert caught.value.issues[0].got == str(bound_step(assemble(model)))


def test_breps_without_faces_are_refused() -> None:
    document = read_solid("sphere") | {"invalid_faces": "skip"}
    document["faces"][0]["loops"][0]["edges"] = [0, 99]
    document["faces"][0]["loops"][0].pop("pcurves", None)
    document["faces"][0]["loops"][0].pop("reversed", None)
    with pytest.raises(InvalidRequest) as caught:
        write(document)
    assert caught.value.issues[0].code == "no_geometry"
