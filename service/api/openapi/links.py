"""Where one can go from an answer, in the OpenAPI document: links to other operations by the id."""

from service.api.openapi.references import Json

_BY_ID = {
    "Definition": ("getSurface", "The definition of the surface."),
    "Mesh": ("getSurfaceMesh", "Its mesh, in the format of a suffix."),
    "Removal": ("deleteSurface", "Its removal, where that is allowed."),
}


def links(where: str, *names: str) -> Json:
    """Links to operations on the surface whose id stands there: an OpenAPI runtime expression."""
    return {
        name: {
            "operationId": _BY_ID[name][0],
            "description": _BY_ID[name][1],
            "parameters": {"id": where},
        }
        for name in names
    }
