"""Hostile files of meshes: each must be refused with a code, or be read as what it then is."""

import gzip
import io
import random
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.examples.catalogue import find
from tools.hostile.gltf import SQUARE, Gltf, build_triangle, write_glb

READ = ""
"""The code of a file that is read: what is hostile in it is left out."""

ANY = "?"
"""The code of a file that may be read, or refused with any code."""


@dataclass(frozen=True)
class HostileMesh:
    """A file, its format, and the code of its error, or `READ` or `ANY`."""

    name: str
    format: str
    build: Callable[[], bytes]
    code: str = ANY


@cache
def write_mesh(name: str) -> bytes:
    """A cone in a format; `ply ascii` and `stl ascii` are the texts of these."""
    if name == "ply ascii":
        return (
            b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
            b"property float z\nelement face 2\nproperty list uchar int vertex_indices\n"
            b"end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0.5\n3 0 1 2\n3 0 2 3\n"
        )
    name, _, form = name.partition(" ")
    options = EncodeOptions(stl="ascii" if form else "binary")
    surface, mesh_options = find("cone").surface(), MeshOptions(resolution=(3, 3))
    return render(surface, mesh_options, BY_NAME[name], options)


FORMS = ("glb", "gltf", "obj", "ply", "ply ascii", "stl", "stl ascii", "off")
"""The forms in which files are cut, changed and renamed."""


def _case(name: str, fmt: str, content: bytes, code: str = ANY) -> HostileMesh:
    return HostileMesh(name, fmt, lambda: content, code)


def build_damaged_cases() -> Iterator[HostileMesh]:
    """Files that are cut, that belong to another format, or of which some bytes are others."""
    generator = random.Random(20261201)
    for form in FORMS:
        fmt, content = form.split()[0], write_mesh(form)
        # Of a text that is cut at the end of a line, the rest may be read.
        cut = {"glb": "malformed_file", "ply": "malformed_file", "gltf": "malformed_body"}
        code = cut.get(form, ANY)
        other_code = find_other_code(fmt)
        for share in (0.3, 0.5, 0.7, 0.9):
            yield _case(f"{form} cut at {share}", fmt, content[: int(share * len(content))], code)
        yield _case(f"{form} without its last byte", fmt, content[:-1], code)
        for number in range(8):
            yield _case(f"{form} changed {number}", fmt, _change(content, generator))
        yield _case(f"{form} in GZIP", fmt, gzip.compress(content, mtime=0), other_code)
        for other in FORMS:
            if other.split()[0] not in {fmt, "gltf" if fmt == "glb" else ""}:
                yield _case(f"{other} as {form}", fmt, write_mesh(other), other_code)
    for fmt in ("glb", "gltf", "obj", "ply", "stl", "off"):
        code = find_other_code(fmt)
        yield _case(f"nothing as {fmt}", fmt, b"", code)
        yield _case(f"zero bytes as {fmt}", fmt, bytes(5000), code)
        yield _case(f"line feeds as {fmt}", fmt, b"\n" * 100_000, code)
        yield _case(f"random bytes as {fmt}", fmt, generator.randbytes(5000), code)


def find_other_code(fmt: str) -> str:
    """The code of a file that is in another format: every text is OBJ, but without a face."""
    return "no_geometry" if fmt == "obj" else "malformed_body"


def _change(content: bytes, generator: random.Random) -> bytes:
    """The content with a few bytes changed, left out or repeated."""
    changed = bytearray(content)
    for _ in range(generator.randint(1, 6)):
        place = generator.randrange(len(changed))
        match generator.randrange(4):
            case 0:
                changed[place] ^= 1 << generator.randrange(8)
            case 1:
                changed[place] = generator.choice(b"\0\xff-9e./ \n")
            case 2:
                del changed[place : place + generator.randint(1, 40)]
            case _:
                changed[place:place] = changed[place : place + generator.randint(1, 40)]
    return bytes(changed)


def build_number_cases() -> Iterator[HostileMesh]:
    """Coordinates that no surface has, and indices of no vertex."""
    codes = {
        "nan": "not_finite",
        "inf": "not_finite",
        "-1e999": "not_finite",
        "9" * 100_000: "not_finite",
        "1e308": "coordinate_too_large",
        "-1e39": "coordinate_too_large",
    }
    for text, code in codes.items():
        title, word = text[:6], text.encode()
        yield _case(f"{title} in OBJ", "obj", b"v 0 0 0\nv 1 0 0\nv 0 1 %b\nf 1 2 3" % word, code)
        off = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 %b\n3 0 1 2" % word
        yield _case(f"{title} in OFF", "off", off, code)
        facet = (
            b"facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 %b\n" % word
        )
        stl = b"solid\n%bendloop\nendfacet\nendsolid" % facet
        yield _case(f"{title} in STL", "stl", stl, code)
        ply = write_mesh("ply ascii").replace(b"float", b"double").replace(b"0.5", word)
        yield _case(f"{title} in PLY", "ply", ply, code)
    for value, code in ((np.nan, "not_finite"), (np.inf, "not_finite")):
        points = np.array(SQUARE[:3])
        points[2, 1] = value
        gltf = Gltf()
        gltf.node(mesh=gltf.mesh(POSITION=gltf.array(points)))
        yield _case(f"{value} in GLB", "glb", gltf.write(), code)
        record = np.append(np.zeros(3), points).astype("<f4").tobytes() + b"\0\0"
        stl = bytes(80) + struct.pack("<I", 1) + record
        yield _case(f"{value} in binary STL", "stl", stl, code)
    for scale in (1e300, 1e-300):
        gltf = build_triangle()
        gltf.document["nodes"][0] |= {"scale": [scale] * 3, "rotation": [scale, 0, 0, scale]}
        yield _case(f"a node of the size {scale}", "glb", gltf.write())
    for index in (3, 255, 65_535, 2**32 - 1):
        gltf = Gltf()
        indices = gltf.array([0, 1, index], "u4")
        gltf.node(mesh=gltf.mesh(POSITION=gltf.array(SQUARE[:3]), indices=indices))
        yield _case(f"the index {index} in GLB", "glb", gltf.write(), "index_out_of_range")
    for word in (b"0", b"4", b"-4", b"4294967296", b"9223372036854775807"):
        obj = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 " + word
        title = f"the index {word.decode()} in "
        yield _case(title + "OBJ", "obj", obj, "index_out_of_range")
        off = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 " + (b"3" if word == b"0" else word)
        yield _case(title + "OFF", "off", off, ANY)
        ply = write_mesh("ply ascii").replace(b"3 0 2 3", b"3 0 2 " + word)
        yield _case(title + "PLY", "ply", ply, READ if word == b"0" else "index_out_of_range")


def build_count_cases() -> Iterator[HostileMesh]:
    """Files that say they have billions of things."""
    for count in (10**6 + 3, 3 * 10**9, 2**63):
        for name in ("accessors", "bufferViews", "buffers"):
            gltf = build_triangle()
            gltf.write()
            field = "count" if name == "accessors" else "byteLength"
            gltf.document[name][0][field] = count
            content = write_glb(gltf.document, gltf.content)
            yield _case(f"{count} as {field} of {name}", "glb", content)
        gltf = Gltf()
        position = gltf.accessor(None, "f4", 3 * count, 2)
        gltf.node(mesh=gltf.mesh(POSITION=position))
        yield _case(f"{count} triangles of zeros", "glb", gltf.write(), "too_many_triangles")
        digits = str(count).encode()
        off = b"OFF\n%b 1 0\n0 0 0\n" % digits
        yield _case(f"{count} vertices of OFF", "off", off)
        yield _case(f"{count} faces of OFF", "off", b"OFF\n1 %b 0\n0 0 0\n" % digits)
        for old in (b"vertex 4", b"face 2"):
            new = old[:-1] + digits
            for form in ("ascii", "binary_big_endian"):
                ply = write_mesh("ply ascii").replace(old, new).replace(b"ascii", form.encode())
                yield _case(f"{new.decode()} in PLY {form}", "ply", ply)
        stl = bytes(80) + struct.pack("<I", count % 2**32) + bytes(50)
        yield _case(f"{count} triangles of STL", "stl", stl, "malformed_body")
    ply = write_mesh("ply ascii").replace(b"3 0 1 2", b"4000000000 0 1 2")
    yield _case("a face of billions of corners", "ply", ply, "malformed_file")
    head = (
        write_mesh("ply ascii").partition(b"0 0 0\n")[0].replace(b"ascii", b"binary_little_endian")
    )
    face = bytes(48) + struct.pack("<I", 2**32 - 1) + bytes(12)
    ply = head.replace(b"list uchar", b"list uint") + face
    yield _case("a binary face of billions of corners", "ply", ply, "malformed_file")
    yield HostileMesh("a face of many corners", "obj", partial(_write_face, 2_000_000))
    yield HostileMesh("many vertices", "obj", lambda: b"v 0 0 0\n" * 1_000_000 + b"f 1 1 1")


def _write_face(corners: int) -> bytes:
    """One vertex, and a face that has it very often."""
    return b"v 0 0 0\nf" + b" 1" * corners


def build_scene_cases() -> Iterator[HostileMesh]:
    """Scenes with many, deep or circular nodes, and what else a GLB may have."""
    gltf = build_triangle()
    gltf.node(is_root=False, children=[0])
    gltf.document["nodes"][0]["children"] = [1]
    yield _case("nodes in a circle", "glb", gltf.write(), "malformed_body")
    gltf = build_triangle()
    for number in range(40):  # each has the one before twice below it: 2^40 instances
        gltf.node(is_root=False, children=[number, number])
    gltf.document["scenes"][0]["nodes"] = [40]
    yield _case("a tree that doubles", "glb", gltf.write(), "malformed_body")
    yield HostileMesh("20,000 nodes below each other", "glb", partial(_write_chain, 20_000), READ)
    yield HostileMesh("2,000 nodes", "glb", partial(_write_instances, 2000), "too_many_triangles")
    yield HostileMesh("300,000 nodes", "glb", partial(_write_nodes, 300_000))
    yield HostileMesh("many primitives", "glb", partial(_write_primitives, 20_000))
    yield HostileMesh("a picture of gigabytes", "glb", _write_picture, READ)
    yield _case("nested JSON", "gltf", b'{"asset":' + b"[" * 100_000, "malformed_body")
    text = b'{"asset":{"version":"2.0"},"nodes":[' + b"{}," * 300_000 + b"{}]}"
    yield _case("nodes of nothing", "gltf", text, "no_geometry")
    digits = b'{"asset":{"version":"2.0"},"scene":' + b"9" * 100_000 + b"}"
    yield _case("a long number", "gltf", digits, "malformed_body")
    for fmt in ("glb", "obj", "off", "ply", "stl"):
        name = f"an archive of many vertices as {fmt}"
        yield HostileMesh(name, fmt, _write_archive, find_other_code(fmt))
    for uri in (
        "/dev/zero",
        "file:///etc/passwd",
        "http://127.0.0.1:1/a.bin",
        "data:,",
        "data:x,!",
    ):
        gltf = build_triangle()
        gltf.write()
        gltf.document["buffers"][0]["uri"] = uri
        yield _case(f"bytes at {uri}", "glb", write_glb(gltf.document), "malformed_file")
    for name in ("/dev/zero", "../../etc/passwd"):
        obj = b"mtllib %b\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3" % name.encode()
        yield _case(f"materials at {name}", "obj", obj, READ)
        comment = b"comment TextureFile %b\nelement vertex" % name.encode()
        ply = write_mesh("ply ascii").replace(b"element vertex", comment, 1)
        yield _case(f"a texture at {name}", "ply", ply, READ)


@cache
def _write_archive() -> bytes:
    """24 kB of ZIP with 24 MB of vertices."""
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("a.obj", b"v 0 0 0\n" * 3_000_000)
    return archive.getvalue()


def _write_chain(count: int) -> bytes:
    """A triangle below this many nodes, each below the one before."""
    gltf = build_triangle()
    for number in range(count):
        gltf.node(is_root=False, children=[number], translation=[1, 0, 0])
    gltf.document["scenes"][0]["nodes"] = [count]
    return gltf.write()


def _write_instances(count: int) -> bytes:
    """This many instances of a mesh of 20,000 triangles: of 720 kB, they would take gigabytes."""
    gltf = Gltf()
    mesh = gltf.mesh(POSITION=gltf.array(np.zeros((60_000, 3))))
    for _ in range(count):
        gltf.node(mesh=mesh)
    return gltf.write()


def _write_nodes(count: int) -> bytes:
    """Many nodes that place one triangle."""
    gltf = build_triangle()
    gltf.document["nodes"] *= count
    gltf.document["scenes"][0]["nodes"] = list(range(count))
    return gltf.write()


def _write_primitives(count: int) -> bytes:
    """A mesh with many primitives, each with an accessor of its own on the same bytes."""
    gltf = build_triangle()
    gltf.document["accessors"] *= count
    primitives = [{"attributes": {"POSITION": number}} for number in range(count)]
    gltf.document["meshes"][0]["primitives"] = primitives
    return gltf.write()


def _write_picture() -> bytes:
    """A GLB whose texture, 200 kB of PNG, has 14,000 × 14,000 pixels."""
    size = 14_000
    packer = zlib.compressobj(9)
    rows = b"".join(packer.compress(bytes(size + 1)) for _ in range(size)) + packer.flush()
    header = struct.pack(">IIBBBBB", size, size, 8, 0, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", rows), (b"IEND", b""))
    picture = b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )
    gltf = build_triangle(material=0)
    view = gltf.view(picture)
    gltf.document |= {
        "images": [{"bufferView": view, "mimeType": "image/png"}],
        "textures": [{"source": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    }
    return gltf.write()


MESHES: tuple[HostileMesh, ...] = (
    *build_damaged_cases(),
    *build_number_cases(),
    *build_count_cases(),
    *build_scene_cases(),
)
"""All cases."""
