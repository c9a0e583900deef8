"""Colours of STEP files: of solids, shells, faces and instances."""

import pytest

from tests.decoders.step.test_products import assembly, mapped_item, solid
from tests.decoders.step.written import Writer, read_part

RED, BLUE = "COLOUR_RGB('',1.,0.,0.)", "COLOUR_RGB('',0.,0.,1.)"


def test_colours_of_solids_shells_and_faces() -> None:
    writer = Writer()
    item = writer.tetrahedron()
    shell, face = f"#{int(item[1:]) - 1}", f"#{int(item[1:]) - 2}"
    assert "CLOSED_SHELL" in writer.lines[int(shell[1:]) - 1]
    writer.style(shell, RED)
    writer.style(face, BLUE)
    part = read_part(writer, item)
    assert part.color == (1.0, 0.0, 0.0)
    assert [each.color for each in part.faces] == [(1.0, 0.0, 0.0)] * 3 + [(0.0, 0.0, 1.0)]


def test_the_colour_of_a_solid_stands_for_its_faces() -> None:
    writer = Writer()
    item = writer.tetrahedron()
    writer.style(item, "DRAUGHTING_PRE_DEFINED_COLOUR('yellow')")
    part = read_part(writer, item)
    assert part.color == (1.0, 1.0, 0.0)
    assert {each.color for each in part.faces} == {None}


@pytest.mark.parametrize("is_first", [True, False])
def test_styles_that_over_ride_others(is_first: bool) -> None:
    writer = Writer()
    item = writer.tetrahedron()
    for over_rides in (is_first, not is_first):
        if over_rides:
            writer.style(item, RED, "OVER_RIDING_STYLED_ITEM", ",#1")
        else:
            writer.style(item, BLUE)
    assert read_part(writer, item).color == (1.0, 0.0, 0.0)


def test_transparency() -> None:
    writer = Writer()
    item = writer.tetrahedron()
    color = writer(RED)
    clear = writer("SURFACE_STYLE_TRANSPARENT(0.25)")
    rendering = writer(f"SURFACE_STYLE_RENDERING_WITH_PROPERTIES($,{color},({clear}))")
    side = writer(f"SURFACE_SIDE_STYLE('',({rendering}))")
    usage = writer(f"SURFACE_STYLE_USAGE(.BOTH.,{side})")
    style = writer(f"PRESENTATION_STYLE_ASSIGNMENT(({usage}))")
    writer(f"STYLED_ITEM('',({style}),{item})")
    assert read_part(writer, item).color == (1, 0, 0, 0.75)


def test_styles_of_curves_colour_no_surface() -> None:
    writer = Writer()
    item = writer.tetrahedron()
    curve = writer(f"CURVE_STYLE('',$,POSITIVE_LENGTH_MEASURE(0.1),{writer(RED)})")
    style = writer(f"PRESENTATION_STYLE_ASSIGNMENT(({curve}))")
    writer(f"STYLED_ITEM('',({style}),{item})")
    assert read_part(writer, item).color is None


def test_colours_are_between_0_and_1() -> None:
    writer = Writer()
    item = writer.tetrahedron()
    writer.style(item, "COLOUR_RGB('',-1.,2.,0.5)")
    assert read_part(writer, item).color == (0, 1, 0.5)


def test_colours_of_instances() -> None:
    writer = Writer()
    top, part = assembly(writer, "top"), solid(writer, "part")
    origin = writer.frame()
    places = [writer.occurrence(top, part, (origin, writer.frame((x, 0, 0)))) for x in (1, 2)]
    item = next(f"#{k + 1}" for k, line in enumerate(writer.lines) if "FACETED_BREP" in line)
    writer.style(item, BLUE)
    writer.style(item, RED, "CONTEXT_DEPENDENT_OVER_RIDING_STYLED_ITEM", f",#1,({places[1]})")
    content = writer.read()
    assert [each.color for each in content.definitions[0].placements] == [None, (1.0, 0.0, 0.0)]
    assert content.definitions[1].parts[0].color == (0.0, 0.0, 1.0)


def test_colours_of_mapped_items() -> None:
    writer = Writer()
    context = writer.context(writer.unit())
    inner = writer.representation([writer.tetrahedron()], context)
    item = mapped_item(writer, inner, writer.frame(), writer.frame())
    writer.product("part", writer.representation([item], context))
    writer.style(item, RED)
    assert writer.read().definitions[0].placements[0].color == (1.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "color", ["COLOUR_RGB('',1.,0.)", "COLOUR_RGB('',$,0.,1.)", "PRE_DEFINED_COLOUR('grau')", "A("]
)
def test_malformed_colours(color: str) -> None:
    writer = Writer()
    item = writer.tetrahedron()
    writer.style(item, color)
    assert read_part(writer, item).color is None


def test_styles_that_refer_to_themselves_end() -> None:
    writer = Writer()
    item = writer.tetrahedron()
    number = len(writer.lines) + 1
    writer(f"PRESENTATION_STYLE_ASSIGNMENT((#{number},#{number}))")
    writer(f"STYLED_ITEM('',(#{number}),{item})")
    assert read_part(writer, item).color is None
