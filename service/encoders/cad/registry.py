"""The registry of formats in which surfaces are written as they are defined.

JSON is among them, for negotiation; the schemas write it.
"""

from collections.abc import Mapping
from types import MappingProxyType

from service.encoders.cad import iges, step, vtu
from service.encoders.cad.bounds import estimate_bytes
from service.encoders.cad.format import DefinitionFormat
from service.encoders.format import FileFormat

JSON_DEFINITION = FileFormat(
    name="json",
    title="The surface as JSON",
    media_type="application/json",
    suffix="json",
    is_float32=False,
)

DEFINITION_FORMATS: tuple[DefinitionFormat, ...] = (
    DefinitionFormat(
        name="step",
        title="STEP AP214",
        media_type="model/step",
        suffix="step",
        is_float32=False,
        encode=step.encode,
        estimate=estimate_bytes,
        other_suffixes=("stp", "p21"),
    ),
    DefinitionFormat(
        name="iges",
        title="IGES 5.3",
        media_type="model/iges",
        suffix="igs",
        is_float32=False,
        encode=iges.encode,
        estimate=estimate_bytes,
        other_suffixes=("iges",),
    ),
    DefinitionFormat(
        name="vtu",
        title="VTK unstructured grid of Bézier cells, binary",
        media_type="model/x-vtu",
        suffix="vtu",
        is_float32=False,
        encode=vtu.encode,
        estimate=vtu.estimate_bytes,
        has_trims=False,
    ),
)
"""All formats of definitions but JSON, in the order in which lists name them."""

CONVERSION_FORMATS: tuple[FileFormat, ...] = (JSON_DEFINITION, *DEFINITION_FORMATS)
"""All formats of conversions."""

DEFINITIONS_BY_NAME: Mapping[str, DefinitionFormat] = MappingProxyType(
    {fmt.name: fmt for fmt in DEFINITION_FORMATS}
)
"""All formats of definitions but JSON, by name."""
