"""Small CAD files for tests."""

from pathlib import Path

FOLDER = Path(__file__).parent / "cad_files"

STEP, IGES = "model/step", "model/iges"

TETRAHEDRON = (FOLDER / "faceted_cm.step").read_bytes()
"""Four triangles, in centimetres."""

OPEN_TETRAHEDRON = TETRAHEDRON.replace(b"#56=PLANE", b"#56=OFFSET_PLANE")
"""A tetrahedron with one face whose surface is unknown: the entity #57."""

ASSEMBLY = (FOLDER / "assembly_inch_ap203.step").read_bytes()
"""Two products with solids, ten times placed, in inches."""

IFC = (
    b"ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('IFC4'));\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n"
)
