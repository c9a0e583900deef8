"""Surface and options in, what a mesh would be and whether it would be made out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from service.encoders.format import EncodeOptions, Format, MeshSize
from service.encoders.registry import FORMATS
from service.engine.count import Counts, count
from service.engine.options import MeshOptions
from service.errors import Issue, SurfaceError, TooLarge
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.mesh import PLAIN, Lowerable, carried, plan_model, shares
from service.pipeline.prediction import Known, predict
from service.surface.lowered import GroupModel, Model, PatchModel


@dataclass(frozen=True, slots=True)
class Refusal:
    """One thing for which some formats would be refused."""

    formats: tuple[str, ...]
    issue: Issue


@dataclass(frozen=True, slots=True)
class Estimate:
    """What a mesh would be.

    Attributes
    ----------
    counts : Counts
    exact : bool
        Whether they are those of the report; else upper bounds of them.
    sizes : tuple of (name of a format, bytes, whether they are exact)
        Of the formats that can hold the mesh; else upper bounds.
    refusals : tuple of Refusal
    accepted : bool
        Whether there is a format in which the mesh would be answered.
    """

    counts: Counts
    exact: bool
    sizes: tuple[tuple[str, int, bool], ...]
    refusals: tuple[Refusal, ...]
    accepted: bool


def estimate(
    surface: Lowerable,
    options: MeshOptions,
    encode: EncodeOptions = PLAIN,
    limits: Limits = DEFAULT_LIMITS,
    formats: Sequence[Format] = FORMATS,
) -> Estimate:
    """What `service.pipeline.mesh.render` would give in each of some formats, or refuse.

    At a small part of the cost: shared edges are found, and nothing is evaluated.
    """
    model = surface.lower()
    known: Known = {}
    whole = predict(model, options, known=known)
    once, copies = _counted(model, options, whole, limits)
    sizes: list[tuple[str, int, bool]] = []
    refused: dict[Issue, list[str]] = {}
    accepted = False
    for fmt in formats:
        try:
            size = plan_model(model, options, fmt, encode, limits, known=known).stored
            accepted = True
        except SurfaceError as error:
            for issue in error.issues:
                refused.setdefault(issue, []).append(fmt.name)
            if not isinstance(error, TooLarge):
                continue
            size = predict(*carried(model, options, fmt), shared=shares(fmt, encode), known=known)
        counts = once if shares(fmt, encode) else copies
        if counts is not None:
            size = replace(size, triangles=counts.triangles, quads=counts.quads)
        exact = counts is not None and fmt.fixed
        sizes.append((fmt.name, fmt.byte_bound(size, encode), exact))
    return Estimate(
        copies or Counts(whole.vertices, whole.triangles, whole.quads),
        copies is not None,
        tuple(sizes),
        tuple(Refusal(tuple(names), issue) for issue, names in refused.items()),
        accepted,
    )


def _counted(
    model: Model, options: MeshOptions, whole: MeshSize, limits: Limits
) -> tuple[Counts, Counts] | tuple[None, None]:
    """Counts of the mesh exactly: of every different model once, and of every copy.

    Not of what is swept along curves, nor of wires with faces: how often these bend is seen only
    when they are made. Nor of what is too large to be made anyway.
    """
    models = model.models if isinstance(model, GroupModel) else (model,)
    if options.solid_wires or whole.vertices > limits.max_vertices:
        return None, None
    found: list[Counts] = []
    for own in models:
        if not isinstance(own, PatchModel):
            return None, None
        found.append(count(own, options) if options.surface else Counts(0, 0, 0))
    copies = found
    if isinstance(model, GroupModel):
        copies = [found[member.model] for member in model.members]
    return _added(found), _added(copies)


def _added(counts: Sequence[Counts]) -> Counts:
    return Counts(
        sum(each.vertices for each in counts),
        sum(each.triangles for each in counts),
        sum(each.quads for each in counts),
    )


def estimate_object(found: Estimate) -> dict[str, object]:
    """The estimate as a JSON object."""
    return {
        "vertices": found.counts.vertices,
        "triangles": found.counts.triangles,
        "quads": found.counts.quads,
        "exact": found.exact,
        "bytes": {name: size for name, size, _ in found.sizes},
        "exact_bytes": [name for name, _, exact in found.sizes if exact],
        "accepted": found.accepted,
        "refused": [
            {
                "formats": list(refusal.formats),
                "code": refusal.issue.code,
                "pointer": refusal.issue.pointer,
                "detail": refusal.issue.message,
                "got": refusal.issue.got,
                "needed": refusal.issue.needed,
            }
            for refusal in found.refusals
        ],
    }
