"""Surface and options in, what a mesh would be and whether it would be made out."""

from collections.abc import Sequence
from dataclasses import dataclass

from service.encoders.format import EncodeOptions, Format
from service.encoders.registry import FORMATS
from service.engine.count import Counts
from service.engine.curvatures.stretches import with_stretches
from service.engine.options import MeshOptions
from service.errors import Issue, SurfaceError, TooLarge
from service.pipeline.foresight import foreseen
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.memory import check_lowering
from service.pipeline.mesh import PLAIN, Lowerable, carried, plan_model, shares
from service.pipeline.prediction import Known, predict


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
    memory : tuple of (name of a format, bytes)
        What the work would take at most, in the formats in which the mesh would be answered.
    refusals : tuple of Refusal
    accepted : bool
        Whether there is a format in which the mesh would be answered.
    certain : bool
        Whether nothing else can be refused once the mesh is made.
    """

    counts: Counts
    exact: bool
    sizes: tuple[tuple[str, int, bool], ...]
    memory: tuple[tuple[str, int], ...]
    refusals: tuple[Refusal, ...]
    accepted: bool
    certain: bool


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
    check_lowering(surface, limits)
    model = surface.lower()
    if options.curvatures:
        # Copies that are bent in different ways are stored apart.
        model = with_stretches(model)
    known: Known = {}
    whole = predict(model, options, known=known)
    expected = foreseen(model, options, whole, limits, encode)
    sizes: list[tuple[str, int, bool]] = []
    memory: list[tuple[str, int]] = []
    refused: dict[Issue, list[str]] = {}
    accepted, certain = False, expected.certain
    for fmt in formats:
        try:
            work = plan_model(model, options, fmt, encode, limits, known=known, expected=expected)
            size, accepted = work.stored, True
            memory.append((fmt.name, work.memory))
            certain &= options.accuracy is None or expected.copies.triangles <= work.affordable
        except SurfaceError as error:
            for issue in error.issues:
                refused.setdefault(issue, []).append(fmt.name)
            if not isinstance(error, TooLarge):
                continue
            size = predict(*carried(model, options, fmt), shared=shares(fmt, encode), known=known)
        most = fmt.byte_bound(expected.within(size, shared=shares(fmt, encode)), encode)
        if options.accuracy is not None:
            certain &= most <= limits.max_bytes
            most = min(most, limits.max_bytes, options.accuracy.max_bytes or most)
        sizes.append((fmt.name, most, expected.exact and fmt.fixed))
    return Estimate(
        expected.copies,
        expected.exact,
        tuple(sizes),
        tuple(memory),
        tuple(Refusal(tuple(names), issue) for issue, names in refused.items()),
        accepted,
        certain or not accepted,
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
        "memory": dict(found.memory),
        "accepted": found.accepted,
        "certain": found.certain,
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
