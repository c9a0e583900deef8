"""Formats of files that are not read, by name, with what to send in their place.

Some belong to a CAD system or kernel, all of which write STEP; others have surfaces in a form that
one program writes; meshes, pictures and documents have no surfaces. A file is known by its media
type, by its suffix, or by its first bytes, whatever its name says.
"""

import re
from dataclasses import dataclass

from service.errors import Issue

SNIFFED_BYTES = 4096
"""Bytes at the beginning of a file by which its format is known."""


@dataclass(frozen=True, slots=True)
class RefusedFormat:
    """A format that is not read.

    Attributes
    ----------
    title : str
        Its name, as in "a file of …".
    suffixes : tuple of str
        Without a dot, in lower case.
    media_types : tuple of str
    beginning : pattern, optional
        Matches the first bytes of a file.
    advice : str
        What to send instead.
    """

    title: str
    suffixes: tuple[str, ...]
    media_types: tuple[str, ...] = ()
    beginning: re.Pattern[bytes] | None = None
    advice: str = "STEP (.step, AP214 or AP242), which this system writes too"

    def issue(self) -> Issue:
        """The issue for a client that sends such a file."""
        return Issue(
            "format_not_read",
            f"The service does not read files of {self.title}.",
            got=f"a file of {self.title}",
            needed=self.advice,
        )


def _beginning(pattern: bytes) -> re.Pattern[bytes]:
    """A pattern of the first bytes, after a byte order mark and blanks."""
    return re.compile(rb"(?:\xef\xbb\xbf)?\s*(?:" + pattern + rb")", re.DOTALL)


_FIELDS = "in JSON as `control_net`, `degree`, `knots` and `weights` (docs/coming-from.md)"

_SURFACE = "a surface: its control points in JSON (docs/surfaces.md), or a CAD file (STEP, IGES)"

_MESH = "the surface from which the mesh was made: STEP or IGES, or its control points in JSON"

REFUSED: tuple[RefusedFormat, ...] = (
    RefusedFormat(
        "Industry Foundation Classes (IFC)",
        ("ifc", "ifczip", "ifcxml"),
        ("application/x-step", "application/ifc", "model/ifc", "application/p21+ifc"),
        _beginning(rb"ISO-10303-21.*FILE_SCHEMA\s*\(\s*\(\s*'IFC"),
        "the geometry as STEP (.step), which FreeCAD and IfcOpenShell write",
    ),
    RefusedFormat(
        "Open CASCADE (BREP)",
        ("brep", "brp", "xbf", "cbf"),
        ("model/brep", "model/x-brep", "application/x-brep"),
        _beginning(rb"DBRep_DrawableShape|(?:Open )?CASCADE Topology V|BINFILE"),
        "STEP (.step), which FreeCAD, CadQuery and build123d write too",
    ),
    RefusedFormat(
        "ACIS (SAT, SAB)",
        ("sat", "sab", "asat", "asab", "smt", "smb"),
        ("model/sat", "application/sat", "application/sab", "application/vnd.sat"),
        _beginning(
            rb"(?:ACIS|ASM) BinaryFile|\d{3,6} \d+ \d+ \d+\s+@?\d+ .{0,300}?\b(?:ACIS|ASM) "
        ),
    ),
    RefusedFormat(
        "Parasolid (XT)",
        ("x_t", "x_b", "xmt_txt", "xmt_bin", "p_b"),
        ("model/vnd.parasolid.transmit.text", "model/vnd.parasolid.transmit.binary"),
        _beginning(rb"\*\*ABCDEFGHIJKLMNOPQRSTUVWXYZ|\*\*PART1;|PS\0\0"),
    ),
    RefusedFormat("JT", ("jt",), ("model/jt",), _beginning(rb"Version \d+\.\d+ JT")),
    RefusedFormat(
        "SolidWorks, Creo, NX, CATIA, Inventor or Solid Edge",
        (
            *("sldprt", "sldasm", "prt", "asm", "ipt", "iam", "par", "psm"),
            *("catpart", "catproduct", "cgr", "3dxml", "f3d", "f3z"),
        ),
        ("application/sldworks", "application/vnd.solidworks", "application/vnd.catia"),
        _beginning(rb"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1|V5_CFV2|#UGC:2"),
    ),
    RefusedFormat("FreeCAD", ("fcstd",), (), _beginning(rb"PK\x03\x04.{26}Document\.xml")),
    RefusedFormat(
        "AutoCAD (DWG, DXF)",
        ("dwg", "dxf"),
        ("image/vnd.dwg", "image/vnd.dxf", "application/acad", "image/x-dwg", "image/x-dxf"),
        _beginning(rb"AC10\d\d[\0\r\n]|0\s+SECTION\s+2\s+HEADER"),
        "STEP (.step) or IGES (.igs)",
    ),
    RefusedFormat(
        "STEP as XML (Part 28) or in an archive",
        ("stpx", "stpxz", "stpz", "stpnc"),
        ("model/step+xml", "model/step+zip", "model/step-xml+zip"),
        _beginning(rb"<\?xml.*urn:oid:1\.0\.10303|PK\x03\x04.{26}[^\0]{0,200}?\.(?:stp|step)"),
        "STEP as clear text (.step, Part 21), not compressed",
    ),
    RefusedFormat(
        "XML, as G+Smo and splinepy write it",
        ("xml",),
        ("application/xml", "text/xml"),
        _beginning(rb"<\?xml|<xml\b|<Geometry\b"),
        f"IGES (.igs), which splinepy writes too; or each surface {_FIELDS}",
    ),
    RefusedFormat(
        "BezierView (BV)",
        ("bv",),
        (),
        None,
        "OOGL (.bez) with the same points, in which u varies fastest; B-splines and triangles "
        + _FIELDS,
    ),
    RefusedFormat(
        "RenderMan (RIB)",
        ("rib",),
        ("application/x-rib",),
        _beginning(rb"##RenderMan RIB"),
        f"each NuPatch {_FIELDS}; in `P` and `Pw` u varies fastest",
    ),
    RefusedFormat(
        "Universal Scene Description (USD)",
        ("usd", "usda", "usdc", "usdz"),
        ("model/vnd.usd", "model/vnd.usda", "model/vnd.usdz+zip"),
        _beginning(rb"#usda |PXR-USDC|PK\x03\x04.{26}[^\0]{0,200}?\.usd"),
        f"each NurbsPatch {_FIELDS}; in `points` u varies fastest",
    ),
    RefusedFormat(
        "Maya, 3ds Max, Cinema 4D or Blender",
        ("ma", "mb", "max", "c4d", "blend"),
        (),
        _beginning(rb"//Maya ASCII|BLENDER[-_]"),
        f"STEP, IGES or OBJ with `surf`, as NURBS; or each surface {_FIELDS}",
    ),
    RefusedFormat(
        "OpenSCAD",
        ("scad", "csg"),
        (),
        None,
        f"the control points {_FIELDS}; solids as STEP, by FreeCAD",
    ),
    RefusedFormat(
        "IRIT (ITD), MFEM or VTK",
        ("itd", "ibd", "mesh", "vtk", "vtu", "vtp", "vts"),
        ("model/vnd.vtk", "application/vnd.vtk"),
        _beginning(rb"# vtk DataFile|MFEM |<VTKFile"),
        f"each surface {_FIELDS}; of meshes, {_MESH}",
    ),
    RefusedFormat(
        "several arrays (NPZ, MAT)",
        ("npz", "mat"),
        ("application/x-npz",),
        _beginning(rb"PK\x03\x04.{26}[^\0]{0,200}?\.npy|MATLAB 5\.0"),
        "one control net (r, c, 3), or (r, c, 4) with weights, as numpy.save writes it (.npy)",
    ),
    RefusedFormat(
        "triangles or polygons (STL, PLY, OFF, glTF, 3MF, 3DS, FBX, …)",
        (
            *("stl", "ply", "off", "glb", "gltf", "3mf", "3ds", "fbx", "dae", "amf", "wrl", "x3d"),
            *("skp", "lwo", "abc"),
        ),
        (
            *("model/stl", "model/ply", "model/x-off", "model/gltf-binary", "model/gltf+json"),
            *("model/3mf", "application/x-3ds", "model/vnd.collada+xml", "model/vrml"),
        ),
        _beginning(
            rb"solid [^\0]{0,200}?facet |ply\s+format |(?:ST)?C?N?4?n?OFF\s|glTF|Kaydara FBX|#VRML|"
            rb"PK\x03\x04.{26}[^\0]{0,200}?\.model"
        ),
        f"{_MESH}; POST /v1/check compares a mesh with its surface",
    ),
    RefusedFormat(
        "pictures (PNG, JPEG, GIF, WebP, TIFF, BMP, SVG)",
        (
            *("png", "jpg", "jpeg", "gif", "webp", "tif", "tiff", "bmp", "svg", "heic", "avif"),
            *("ico", "psd", "exr", "hdr"),
        ),
        (
            *("image/png", "image/jpeg", "image/gif", "image/webp", "image/tiff", "image/bmp"),
            *("image/svg+xml", "image/heic", "image/avif"),
        ),
        _beginning(rb"\x89PNG|\xff\xd8\xff|GIF8|RIFF.{4}WEBP|II\*\0|MM\0\*|BM.{4}\0\0\0\0|<svg\b"),
        _SURFACE,
    ),
    RefusedFormat(
        "documents and tables (PDF, HTML, DOCX, XLSX, CSV)",
        ("pdf", "html", "htm", "doc", "docx", "odt", "xls", "xlsx", "ods", "csv", "md", "rtf"),
        ("application/pdf", "text/html", "text/csv", "text/markdown"),
        _beginning(rb"%PDF-|<!DOCTYPE html|<!doctype html|<html\b|\{\\rtf"),
        _SURFACE,
    ),
    RefusedFormat(
        "archives (ZIP, TAR, GZIP, 7Z, RAR)",
        ("zip", "tar", "gz", "tgz", "bz2", "xz", "zst", "7z", "rar"),
        ("application/zip", "application/gzip", "application/x-tar", "application/x-7z-compressed"),
        _beginning(rb"PK\x03\x04|PK\x05\x06|\x1f\x8b|7z\xbc\xaf|Rar!|\xfd7zXZ|BZh\d|\(\xb5/\xfd"),
        "the files in it, unpacked",
    ),
)
"""All of these formats; of two that fit the first bytes, the first counts.

The editor compares beginnings, too: their patterns mean the same in JavaScript, with the flag `s`,
in texts of Latin-1."""


def find_by_suffix(suffix: str) -> RefusedFormat | None:
    """The format with this suffix; without a dot, in any case."""
    return next((each for each in REFUSED if suffix.lower() in each.suffixes), None)


def find_by_media_type(media_type: str) -> RefusedFormat | None:
    """The format with this media type, which is in lower case and has no parameters."""
    return next((each for each in REFUSED if media_type in each.media_types), None)


def find_by_content(content: bytes) -> RefusedFormat | None:
    """The format of a file that begins with these bytes."""
    start = content[:SNIFFED_BYTES]
    return next((each for each in REFUSED if each.beginning and each.beginning.match(start)), None)
