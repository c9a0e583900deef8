"""The codes of single issues, in words: what `errors[].code` can be."""

from collections.abc import Mapping
from types import MappingProxyType

CODES: Mapping[str, str] = MappingProxyType(
    {
        # The document.
        "malformed_json": "the body is not one JSON document",
        "malformed_body": "the body is no file of the type that it is said to be",
        "repeated_key": "an object or a query has the same key twice",
        "too_many_values": "more numbers, lists or components than are taken",
        "too_many_strings": "more strings or objects than are taken",
        "too_deep": "brackets nested more deeply than is read",
        "missing_field": "a required field is not there",
        "unknown_field": "there is no such field or parameter",
        "conflicting_options": "two options or fields of which only one can hold",
        "null_value": "null is not a value: leave the field out",
        "wrong_type": "another JSON type than needed",
        "wrong_value": "a value that is none of those allowed",
        "wrong_length": "a list or a string that is too short or too long",
        "out_of_range": "a number that is too small or too large",
        "not_finite": "a number beyond double precision",
        "empty_list": "a list of nothing",
        "repeated_value": "the same value twice in a list",
        "unknown_type": "there is no such kind of surface or curve",
        "unknown_operation": "there is no such conversion",
        # Control nets and weights.
        "ragged": "rows of lengths that do not fit together",
        "wrong_dimension": "a point with too few or too many coordinates, or a net of other levels",
        "too_few_points": "fewer control points than the form needs",
        "too_many_control_points": "more control points than are taken",
        "coordinate_too_large": "a coordinate beyond single precision, here or where it is placed",
        "degree_too_high": "a degree above the limit of the service, the format or the method",
        "degree_too_low": "a degree below that of the surface",
        "weights_shape": "weights in another shape than the control net",
        "weight_not_positive": "a weight that is zero or negative",
        "weight_ratio": "weights so different that control points would be lost",
        # Knots.
        "knots_decrease": "a knot below the one before it",
        "knot_multiplicity": "a knot that is repeated too often",
        "knot_too_large": "a knot beyond single precision",
        "knots_too_close": "knots that differ by less than 1e-8 of the largest",
        "empty_domain": "knots between which there is no surface",
        "too_many_knots": "a conversion that would lead to more knots than are taken",
        "too_many_spans": "more knot spans than are taken",
        "too_many_bezier_points": "a B-spline whose Bézier patches would have too many points",
        # Patches, channels, sweeps and groups.
        "index_out_of_range": "an index that nothing has",
        "repeated_patch": "a patch that is in two parts",
        "channel_shape": "colours, texture coordinates or attributes in a shape that does not fit",
        "name_clash": "attributes, or a curvature, whose names would be one",
        "degenerate_curve": "a curve without length",
        "nested_group": "a group within a group",
        "not_affine": "a matrix whose last row is not 0, 0, 0, 1",
        "singular_matrix": "a matrix that flattens, or nearly",
        # Questions and conversions.
        "not_parametric": "tubes, ribbons and groups have no parameters of their own",
        "wrong_parameters": "uv where a triangle needs barycentric coordinates, or the reverse",
        "outside_domain": "parameters outside the surface",
        "unexpected_patch": "a patch chosen of a surface that has parameters as a whole",
        "several_patches": "a surface whose patches have no parameters in common",
        "unsupported_operation": "a conversion that this kind of surface does not know",
        "seam_would_open": "a conversion after which neighbours would not fit together",
        # What is asked for, and what it costs.
        "nothing_to_draw": "no faces, and nothing instead of them",
        "budget_too_small": "no mesh of the surface has so few triangles, or bytes",
        "tolerance_too_small": "a tolerance below what the numbers can hold",
        "too_many_points": "a query of more points than are answered",
        "too_many_vertices": "a mesh or curve of more vertices than are answered",
        "too_many_triangles": "a tolerance that takes more triangles than are allowed",
        "too_many_bytes": "an answer of more bytes than are sent",
        "too_many_patches": "a surface of more Bézier patches than are taken",
        "too_much_memory": "work that would take more memory than there is for one request",
        "too_costly": "work of more than some seconds",
        "unsupported_by_format": "quads, lines, wires or a compact form where the format has none",
        "compression_unavailable": "a compression whose library the service was installed without",
        # Where surfaces are kept.
        "store_full": "more bytes than the service may still keep",
        "disk_full": "the disk of the service is full",
        # The connection, before there is a request.
        "malformed_request": "no HTTP/1.1, or HTTP that could be read in two ways",
        "head_too_large": "an address and headers of too many bytes",
        "head_too_slow": "the head of the request did not arrive in time",
        "too_many_connections": "as many connections are open as there may be",
        "draining": "the service ended before the request was done",
        # The request around the body.
        "key_needed": "a call for which a key must be sent, and none was",
        "key_unknown": "a key that is not known here, or not any more",
        "signature_invalid": "a signature that is not one of this address",
        "signature_expired": "a signature that is not good any more",
        "rate_limited": "more requests than one key, or one address, may make",
        "unknown_surface": "no surface has this id",
        "unknown_suffix": "no format has this suffix",
        "unknown_format": "there is no such format",
        "too_many_parameters": "more query parameters than are read",
        "engine_gone": "`engine` is another version of the numbers than is computed here",
        "not_acceptable": "no format in `Accept`, no coding in `Accept-Encoding` is written here",
        "body_too_slow": "the body did not arrive in time",
        "body_too_large": "the body has too many bytes",
        "unsupported_media_type": "the body is not said to be of a type that is taken",
        "unsupported_encoding": "the body is compressed",
    }
)
"""Meaning by code. Kept complete by a test that reads the code."""


def code_list() -> str:
    """The codes as a Markdown list."""
    return "\n".join(f"- `{code}`: {meaning}" for code, meaning in CODES.items())
