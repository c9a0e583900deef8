"""Routes whose body is JSON, or a .npy file with the numbers of one field of the document.

With a file, the query names a surface by its id, and has the other fields of the document:
`?surface=sphere&sign=true`. In a file 100,000 points take 2.4 MB, and the service does not parse
them number by number.
"""

from typing import Any, ClassVar

from service.api.body import BodyRoute, PostedFile, is_long_body
from service.api.computation import Computation
from service.api.named_surface import check_named, parse_named
from service.api.negotiation import Pairs
from service.api.services import Services
from service.decoders.format import Decoder
from service.decoders.npy import read_array
from service.decoders.registry import BY_NAME
from service.schemas.fields import RequestModel
from service.schemas.query import number_from_text, values_from_text

NPY = BY_NAME["npy"]


class ArrayRoute(BodyRoute):
    """A route that reads the whole document as JSON, or one field of it from a .npy file.

    Attributes
    ----------
    array : str
        The name of this field.
    """

    decoders = (NPY,)
    array: ClassVar[str] = "points"

    def read_fields(self, pairs: Pairs, decoder: Decoder) -> dict[str, Any]:
        """The fields in the query of a file, which names a surface; and `format`."""
        del decoder
        values = values_from_text(pairs)
        check_named(values, self.array, "these numbers")
        return {name: _parse_value(value) for name, value in values.items()}

    def read(self, body: bytes) -> Any:
        """The value of the field `array`, from the bytes of a file."""
        return read_array(body)

    async def _read_file(
        self,
        model: type[RequestModel],
        file: PostedFile,
        services: Services,
        computation: Computation,
    ) -> RequestModel:
        """The model of a file, with the surface of the query, which is loaded."""
        content, decoder, _ = file

        def read_array_field() -> dict[str, Any]:
            return {self.array: self.read(content)}

        is_long = is_long_body(content, decoder)
        return await parse_named(
            model, file, services, computation, read_array_field, is_long=is_long
        )


def _parse_value(text: object) -> object:
    """A parameter as a number or a boolean if its text is one; otherwise unchanged."""
    if not isinstance(text, str):
        return text
    return {"true": True, "false": False}.get(text, number_from_text(text))
