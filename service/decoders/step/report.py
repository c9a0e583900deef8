"""The report of reading a file."""

from collections.abc import Iterable

from service.decoders.cad.content import Definition, Reading
from service.decoders.step.assembly import Assembler
from service.decoders.step.header import Header
from service.decoders.step.tally import Tally
from service.decoders.step.units import Units


def write_report(
    header: Header,
    definitions: Iterable[Definition],
    assembler: Assembler,
    units: Iterable[Units],
    tally: Tally,
    *,
    products: int,
    references: int,
) -> Reading:
    """The report of a file that has been read.

    Parameters
    ----------
    units : iterable of Units
        Those of all representations.
    products, references : int
        Numbers of products, and of references to other files.
    """
    parts = list({id(part): part for each in definitions for part in each.parts}.values())
    shells = [shell for part in parts for shell in part.shells]
    metres, gaps, units = assembler.metres, assembler.parts.gaps, list(units)
    named = sorted((each for each in units if each.name), key=lambda each: each.metres != metres)
    uncertainties = [
        each.uncertainty / (metres or each.metres or 1.0)
        for each in units
        if each.uncertainty is not None
    ]
    return Reading(
        "step",
        header.schema,
        header.system,
        tuple(dict.fromkeys(each.name for each in named)),
        metres,
        max(uncertainties, default=None),
        products,
        assembler.parts.count_solids(),
        sum(shell.is_closed for shell in shells),
        sum(not shell.is_closed for shell in shells),
        sum(len(part.faces) for part in parts),
        dict(tally.skipped_entities),
        tuple(tally.skipped_faces),
        edge_gap=gaps.edge,
        vertex_gap=gaps.vertex,
        unfollowed_references=references,
        open_edges=assembler.parts.open_edges,
    )
