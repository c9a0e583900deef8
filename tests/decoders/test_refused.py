"""Formats that are not read are known by their names and by their first bytes."""

import time

import pytest

from service.decoders.refused import find_by_content, find_by_media_type, find_by_suffix

BODIES: dict[str, bytes] = {
    "ifc": b"ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'',"
    b"'','');\nFILE_SCHEMA (('IFC4'));\nENDSEC;",
    "brep": b"\nCASCADE Topology V1, (c) Matra-Datavision\nLocations 0\n",
    "brp": b"DBRep_DrawableShape\n\nCASCADE Topology V3, (c) Open Cascade\n",
    "sat": b"700 0 1 0 \n@8 FreeCAD  @16 ACIS 24.0.1.1 NT @24 Mon Nov 30 06:00:00 2026 \n"
    b"1 9.9999999999999995e-007 1e-010\n",
    "sab": b"ACIS BinaryFile\x04",
    "x_t": b'**ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz*****\n**PARASOLID !"#$%\n',
    "x_b": b"PS\0\0\0?: TRANSMIT FILE created by modeller version",
    "jt": b"Version 9.5 JT  DM 6.4.1".ljust(80) + b"\0",
    "sldprt": b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(500),
    "CATPart": b"V5_CFV2\0\0\0",
    "prt": b"#UGC:2 PART 1234\n",
    "dwg": b"AC1032\0\0\0",
    "dxf": b"  0\r\nSECTION\r\n  2\r\nHEADER\r\n",
    "FCStd": b"PK\x03\x04" + bytes(26) + b"Document.xml<?xml",
    "stpz": b"PK\x03\x04" + bytes(26) + b"part.step" + b"ISO-10303-21",
}

OTHERS: dict[str, tuple[bytes, str]] = {
    "xml": (b"<?xml version='1.0'?>\n<xml><Geometry type='TensorNurbs2' id='0'>", "IGES"),
    "bv": (b"", "OOGL"),
    "rib": (b"##RenderMan RIB-Structure 1.0\n", "NuPatch"),
    "usda": (b'#usda 1.0\n(\n    upAxis = "Y"\n)\n', "NurbsPatch"),
    "usdc": (b"PXR-USDC\0\0", "NurbsPatch"),
    "usdz": (b"PK\x03\x04" + bytes(26) + b"scene.usdc", "NurbsPatch"),
    "ma": (b"//Maya ASCII 2024 scene\n", "OBJ"),
    "blend": (b"BLENDER-v402", "OBJ"),
    "scad": (b"", "control points"),
    "vtu": (b'<VTKFile type="UnstructuredGrid">', "JSON"),
    "mesh": (b"MFEM NURBS mesh v1.0\n", "JSON"),
    "npz": (b"PK\x03\x04" + bytes(26) + b"net.npy", ".npy"),
    "3ds": (b"", "from which the mesh was made"),
    "stl": (b"solid part\nfacet normal 0 0 1\n", "from which the mesh was made"),
    "ply": (b"ply\nformat ascii 1.0\n", "from which the mesh was made"),
    "off": (b"OFF\n4 2 0\n", "from which the mesh was made"),
    "glb": (b"glTF\2\0\0\0", "from which the mesh was made"),
    "3mf": (b"PK\x03\x04" + bytes(26) + b"3D/3dmodel.model", "from which the mesh was made"),
    "png": (b"\x89PNG\r\n\x1a\n", "control points"),
    "jpg": (b"\xff\xd8\xff\xe0", "control points"),
    "webp": (b"RIFF\0\1\0\0WEBPVP8 ", "control points"),
    "svg": (b'<svg xmlns="http://www.w3.org/2000/svg">', "control points"),
    "pdf": (b"%PDF-1.7\n", "CAD file"),
    "html": (b"\n<!DOCTYPE html>\n<html>", "CAD file"),
    "zip": (b"PK\x03\x04" + bytes(26) + b"holiday.txt", "unpacked"),
    "gz": (b"\x1f\x8b\x08\0", "unpacked"),
}
"""Files of other programs that are not CAD systems: their first bytes if these are known, and a
part of `needed`."""


@pytest.mark.parametrize("suffix", BODIES)
def test_a_format_is_known_by_suffix_and_by_content(suffix: str) -> None:
    by_suffix, by_content = find_by_suffix(suffix), find_by_content(BODIES[suffix])
    assert by_suffix is not None
    assert by_suffix is by_content
    issue = by_suffix.issue()
    assert by_suffix.title in issue.message
    assert "STEP" in issue.needed


@pytest.mark.parametrize("suffix", OTHERS)
def test_files_of_other_programs_are_named(suffix: str) -> None:
    content, needed = OTHERS[suffix]
    found = find_by_suffix(suffix)
    assert found is not None
    assert needed in found.issue().needed
    if content:
        assert find_by_content(content) is found


def test_a_format_is_known_by_its_media_type() -> None:
    found = find_by_media_type("model/ifc")
    assert found is find_by_suffix("ifc")
    assert find_by_media_type("model/step") is None
    assert find_by_media_type("model/stl") is find_by_suffix("stl")


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\n",
        b"BEZ214\n1 0 0 1",
        b"2\n1,2,3,4\n3,4,5,6\n6\n0,0,0\n",
        b'{"type": "brep"}',
        b"solid\n1,2,3",
        b"v 0 0 0\ncstype bezier\n",
    ],
)
def test_other_files_are_not_refused(content: bytes) -> None:
    assert find_by_content(content) is None


def test_no_beginning_takes_long_to_look_at() -> None:
    start = time.process_time()
    for content in (
        b"ISO-10303-21" + b"FILE_SCHEMA( " * 4000,
        b"700 0 1 0\n1 " + b"ACIS" * 9000,
        b"7" * 9000,
        b"\n" * 9000,
        b"PK\x03\x04" + b"." * 9000,
        b"solid " + b"facet" * 9000,
    ):
        assert find_by_content(content) in (None, find_by_suffix("zip"))
    assert time.process_time() - start < 0.2
