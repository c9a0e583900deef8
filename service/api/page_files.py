"""The files of the pages: the editor, the documentation, and the scripts that both load.

`make web` bundles the modules of the editor. The names of the bundles contain hashes of their
contents, so browsers keep them for ever, and ask again only for the page itself, which names them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from html import escape
from pathlib import Path
from string import Template
from types import MappingProxyType
from typing import Any

import orjson

from service.api.cors import is_origin
from service.api.page_facts import TEAPOT_SUFFIX, describe_files
from service.api.responses import HEADERS, PAGE_HEADERS
from service.api.static_files import StaticFile
from service.decoders.mesh_registry import MESH_BY_SUFFIX
from service.decoders.registry import BY_SUFFIX
from service.encoders.libraries import list_compressions
from service.engine.mesh.mesh import ENGINE
from service.errors import InvalidSettings
from service.settings.values import Settings
from service.surface.examples.catalogue import EXAMPLES

API = Path(__file__).parent
PAGE, DOCS = API / "page", API / "docs"
"""Folders of the pages in this repository: the editor, and the page that shows Swagger UI."""

STATIC = API / "static"
"""Folder of bundles and of scripts of other projects, which `make web` and the build of the image
fill."""

SWAGGER = ("swagger-ui/swagger-ui-bundle.js", "swagger-ui/swagger-ui.css")

_MEDIA_TYPES = MappingProxyType(
    {".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
)


def _headers(
    directives: str, scripts: str = "'self'", frame_ancestors: Sequence[str] = ()
) -> dict[str, str]:
    """Headers of a page.

    Parameters
    ----------
    directives : str
        Its content security policy for styles and images.
    frame_ancestors : sequence of str
        The origins whose pages may frame it.
    """
    origins = f"default-src 'none'; script-src {scripts}; connect-src 'self'"
    frames = " ".join(frame_ancestors) or "'none'"
    limits = f"base-uri 'none'; form-action 'none'; frame-ancestors {frames}"
    headers = HEADERS | PAGE_HEADERS
    headers |= {"Content-Security-Policy": f"{origins}; {directives}; {limits}"}
    if frame_ancestors:
        del headers["X-Frame-Options"]  # it cannot name an origin
    return headers


COMPRESSIONS = list_compressions()
"""The compressions of meshes that the editor may ask for: those whose library is installed."""

# The decoder of compressed meshes is WebAssembly.
_DRAWING = "'self' 'wasm-unsafe-eval'" if COMPRESSIONS else "'self'"
EDITOR_HEADERS = _headers("style-src 'self'; img-src 'self' data: blob:", _DRAWING)
# Swagger UI sets styles on its elements, which needs `unsafe-inline`.
DOCS_HEADERS = _headers("style-src 'self' 'unsafe-inline'; img-src 'self' data:")


@dataclass(frozen=True, slots=True)
class Bundles:
    """The bundles that `make web` has made, as its `manifest.json` lists them.

    Attributes
    ----------
    files : mapping
        For each file that a page names, such as `main.js`: `file`, its name with the hash, and
        `imports`, the scripts that it loads at once.
    names : tuple of str
        All bundles in the folder.
    """

    folder: Path
    files: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    names: tuple[str, ...] = ()

    @classmethod
    def read(cls, static: Path) -> "Bundles":
        """The bundles in the folder of static files; without files if they are not built."""
        folder = static / "page"
        try:
            manifest = orjson.loads((folder / "manifest.json").read_bytes())
        except FileNotFoundError:
            return cls(folder)
        names = sorted(path.name for path in folder.iterdir() if path.suffix in _MEDIA_TYPES)
        return cls(folder, manifest["files"], tuple(names))

    def file(self, name: str) -> StaticFile:
        """One of `names`, also as Brotli if `make web` has compressed it."""
        path = self.folder / name
        kind, compressed = _MEDIA_TYPES[path.suffix], self.folder / f"{name}.br"
        brotli = StaticFile(compressed.read_bytes, kind, is_immutable=True)
        return StaticFile(
            path.read_bytes,
            kind,
            is_immutable=True,
            brotli=brotli if compressed.is_file() else None,
        )

    def url(self, name: str) -> str:
        """The relative URL of a file that a page names."""
        return f"page/{self.files[name]['file']}"

    def links(self, script: str, style: str) -> dict[str, str]:
        """The links of a page to its files, by the names of variables in the page."""
        later = (f"{each}.js" for each in COMPRESSIONS)
        return {
            "icon": self.url("icon.svg"),
            "style": self.url(style),
            "script": self.url(script),
            "preloads": self._list_preloads(script, *later),
        }

    def _list_preloads(self, script: str, *later: str) -> str:
        """Links that let the browser fetch the imports of a script, and later ones, at once."""
        names = list(self.files[script]["imports"])
        for name in later:
            names += self.files[name]["file"], *self.files[name]["imports"]
        return "\n".join(
            f'<link rel="modulepreload" href="page/{each}">' for each in dict.fromkeys(names)
        )


ROBOTS = b"""\
# Meshes and calls are computed on request: they are nothing to index.
# Sites that show links need pictures.
User-agent: *
Allow: /v1/surfaces/*/image.png
Disallow: /v1/
"""


FIRST_SURFACE = "utah-teapot"
"""The example that the editor opens if its address names none (`main.js`)."""


def editor_name(surface: str) -> str:
    """The name of the editor's page that lets the browser ask for an example at once."""
    return f"page?surface={surface}"


def list_files(document: Callable[[], dict[str, Any]], settings: Settings) -> dict[str, StaticFile]:
    """All files that pages need, and the OpenAPI document; no other file is served.

    A page is missing if its scripts are not installed.

    Parameters
    ----------
    document : callable
        Returns the OpenAPI document.
    settings : Settings
        The limits of files, and the origins whose pages may frame `/embed`.

    Raises
    ------
    InvalidSettings
        If one of `settings.frame_ancestors` is no origin.
    """
    for origin in settings.frame_ancestors:
        _check_frame_ancestor(origin)
    bundles = Bundles.read(STATIC)
    docs_files = [path for name in SWAGGER if (path := STATIC / name).is_file()]
    files = {
        "openapi.json": StaticFile(lambda: orjson.dumps(document()), "application/json"),
        "robots.txt": StaticFile(lambda: ROBOTS, "text/plain"),
        # For responses that are no pages; pages name the icon.
        "favicon.ico": StaticFile((PAGE / "icon.svg").read_bytes, _MEDIA_TYPES[".svg"]),
        **{f"page/{name}": bundles.file(name) for name in bundles.names},
        **_by_name("docs", [DOCS / "start.js", *docs_files]),
    }
    if bundles.files:
        # Without a key, the browser can ask for an example while the scripts are on their way.
        examples = {editor_name(name): name for name in EXAMPLES if settings.public_reads}
        for page, surface in {"page": "", **examples}.items():
            read = partial(_editor_page, bundles, settings, surface)
            files[page] = StaticFile(read, "text/html", EDITOR_HEADERS)
        origins = settings.frame_ancestors
        headers = _headers("style-src 'self'; img-src 'self' blob:", _DRAWING, origins)
        files["embed"] = StaticFile(partial(_embed_page, bundles), "text/html", headers)
    if len(docs_files) == len(SWAGGER):
        files["docs"] = StaticFile((DOCS / "index.html").read_bytes, "text/html", DOCS_HEADERS)
    return files


def _by_name(folder: str, paths: Sequence[Path]) -> dict[str, StaticFile]:
    return {
        f"{folder}/{path.name}": StaticFile(path.read_bytes, _MEDIA_TYPES[path.suffix])
        for path in paths
        if path.suffix in _MEDIA_TYPES
    }


def _editor_page(bundles: Bundles, settings: Settings, surface: str) -> bytes:
    """`index.html`, with the names of the bundles and the lists of file suffixes filled in.

    If `surface` is the name of an example, the browser asks for it and for the list of examples
    before the script does.
    """
    links = bundles.links("main.js", "page.css")
    for path in ("v1/surfaces", f"v1/surfaces/{surface}") if surface else ():
        links["preloads"] += f'\n<link rel="preload" as="fetch" crossorigin href="{path}">'
    suffixes = [".json", *(f".{suffix}" for suffix in (*BY_SUFFIX, TEAPOT_SUFFIX))]
    meshes = [f".{suffix}" for suffix in MESH_BY_SUFFIX if suffix not in BY_SUFFIX]
    return _fill(
        "index.html",
        links,
        engine=ENGINE,
        accept=",".join([*suffixes, *meshes]),
        suffixes=_write_suffixes(suffixes),
        meshes=_write_suffixes(meshes),
        files=escape(orjson.dumps(describe_files(settings)).decode()),
    )


def _write_suffixes(suffixes: Sequence[str]) -> str:
    return ", ".join(f"<code>{suffix}</code>" for suffix in suffixes)


def _embed_page(bundles: Bundles) -> bytes:
    """`embed.html`, with the names of the bundles filled in."""
    return _fill("embed.html", bundles.links("embed.js", "embed.css"))


def _fill(name: str, links: Mapping[str, str], **values: object) -> bytes:
    """A page with its variables replaced: the links to its bundles, and other values."""
    text = Template((PAGE / name).read_text(encoding="utf-8"))
    return text.substitute(links, compression=" ".join(COMPRESSIONS), **values).encode()


def _check_frame_ancestor(text: str) -> None:
    if not is_origin(text):
        raise InvalidSettings(
            f"SURFACE_FRAME_ANCESTORS: got {text!r}, needed an origin such as "
            "https://example.com or http://localhost:8080: in lower case, without a path, and "
            "without a port that is the default."
        )
