"""The content of a CAD file as the document of a surface, a brep or a group, and its report.

One solid that is not placed becomes a `brep`. All else becomes a `group`: every part is one of its
`definitions`, and the instances are its members, in the order of the tree. A product with several
parts, or with instances of other products, is a member without a surface, and what it has are
members below it. An instance of such a product that has a name of its own is a member above that of
its product, so that both names stay. A product of one part gives its name to the definition.

A colour of an instance replaces those of the parts of its product; colours of faces stay.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace

from service.decoders.cad.brep_document import write_brep, write_color
from service.decoders.cad.content import CadContent, FileLimits, Part, Reading
from service.decoders.cad.names import NameCleaner, clean_text
from service.decoders.cad.products import (
    Instance,
    Product,
    check_size,
    count_products,
    find_depth,
    find_instances,
)
from service.decoders.format import Tree
from service.errors import InvalidRequest, Issue, count_nouns

MAX_METRES_PER_UNIT = 1e6

MAX_TEXT = 200
"""The most characters of a text of the file in its report."""


@dataclass(frozen=True, slots=True)
class CadDocument:
    """The document of a surface, and the report of reading, both as trees of plain values."""

    surface: Tree
    reading: Tree


def write_document(content: CadContent, limits: FileLimits | None = None) -> CadDocument:
    """The document of a surface with all that is in a file, and the report of reading.

    Products without faces are left out. Placements that flatten bodies are counted in the report
    as skipped entities `placement`.

    Raises
    ------
    InvalidRequest
        `no_geometry` if no face is placed; `too_deep`.
    TooLarge
        `too_many_faces`, `too_many_members` or `too_many_placed_faces`.
    """
    limits = limits or FileLimits()
    names = NameCleaner()
    products, skipped = count_products(content, names)
    roots, more_skipped = find_instances(content.roots, products, names)
    skipped += more_skipped
    if not roots:
        raise _no_geometry(content.reading)
    find_depth(roots, products)
    check_size(roots, products, limits)
    if len(roots) == 1 and roots[0].matrix is None and products[roots[0].product].is_part:
        tree = _write_single(roots[0], products[roots[0].product], content, names)
    else:
        tree = _write_group(roots, products, content, names)
    metres = content.metres_per_unit
    if metres is not None and 0 < metres <= MAX_METRES_PER_UNIT:
        tree["metres_per_unit"] = float(metres)
    reading = content.reading
    if skipped:
        entities = dict(reading.skipped_entities)
        entities["placement"] = entities.get("placement", 0) + skipped
        reading = replace(reading, skipped_entities=entities)
    changed = reading.changed_names + names.changed
    return CadDocument(tree, write_reading(replace(reading, changed_names=changed)))


def write_reading(reading: Reading) -> Tree:
    """The report as a tree of plain values; what is not known is left out."""
    tree: Tree = {field.name: getattr(reading, field.name) for field in fields(reading)}
    tree["schema"] = clean_text(reading.schema, MAX_TEXT)
    tree["system"] = clean_text(reading.system, MAX_TEXT)
    tree["units"] = [clean_text(unit) for unit in reading.units]
    tree["skipped_entities"] = {
        clean_text(keyword): count for keyword, count in sorted(reading.skipped_entities.items())
    }
    tree["skipped_faces"] = [
        {"entity": clean_text(face.entity), "reason": clean_text(face.reason, MAX_TEXT)}
        for face in reading.skipped_faces
    ]
    return {name: value for name, value in tree.items() if value is not None and value != ""}


def _no_geometry(reading: Reading) -> InvalidRequest:
    """The error for a file without faces, which says why the first face could not be read."""
    faces, entities = reading.skipped_faces, sum(reading.skipped_entities.values())
    got = "no faces"
    if faces:
        reason = clean_text(faces[0].reason, MAX_TEXT)
        got = f"{count_nouns(len(faces), 'faces')} that cannot be read: {reason}"
    elif entities:
        got = f"{count_nouns(entities, 'entities')} of kinds that are not read"
    message, needed = "The file has no faces that could be placed.", "a solid, a shell or a face"
    return InvalidRequest(Issue("no_geometry", message, "", got, needed))


def _write_single(
    root: Instance, product: Product, content: CadContent, names: NameCleaner
) -> Tree:
    """The brep of the only part; faces without a colour get that of the instance or the part."""
    (part,) = product.parts
    tree = write_brep(part, root.name or names.clean(part.name), content.up, names)
    color = _choose_color(root, part)
    if color is not None:
        for face in tree["faces"]:
            face.setdefault("color", color)
    return tree


def _choose_color(instance: Instance, part: Part) -> list[float] | None:
    """The colour of a part of an instance."""
    if instance.color is not None:
        return instance.color
    return None if part.color is None else write_color(part.color)


def _write_group(
    roots: Sequence[Instance],
    products: Mapping[int, Product],
    content: CadContent,
    names: NameCleaner,
) -> Tree:
    """The group of all instances, each product with all that is in it."""
    definitions: list[Tree] = []
    numbers: dict[int, int] = {}
    members: list[Tree] = []

    def find_definition(part: Part, product: Product) -> int:
        number = numbers.setdefault(id(part), len(definitions))
        if number == len(definitions):
            name = product.name if product.is_part else ""
            name = name or names.clean(part.name) or product.name
            definitions.append(write_brep(part, name, content.up, names))
        return number

    def add_member(name: str, parent: int | None, **values: object) -> int:
        given = {"name": name or None, "parent": parent, **values}
        members.append({key: value for key, value in given.items() if value is not None})
        return len(members) - 1

    stack: list[tuple[Instance, int | None]] = [(root, None) for root in reversed(roots)]
    while stack:
        instance, parent = stack.pop()
        product, matrix = products[instance.product], instance.matrix
        if product.is_part:
            (part,) = product.parts
            number, color = find_definition(part, product), _choose_color(instance, part)
            add_member(instance.name, parent, definition=number, color=color, matrix=matrix)
            continue
        own = add_member(instance.name, parent, color=instance.color, matrix=matrix)
        if instance.is_above_product:
            own = add_member(product.name, own)
        for part in product.parts:
            number = find_definition(part, product)
            # Without a colour of its own, the member has that of the instance above it.
            color = None if instance.color is not None else _choose_color(instance, part)
            add_member(definitions[number].get("name", ""), own, definition=number, color=color)
        stack += [(each, own) for each in reversed(product.instances)]
    tree: Tree = {
        "type": "group",
        "up": content.up,
        "definitions": definitions,
        "members": members,
    }
    name = clean_text(content.definitions[content.roots[0].definition].name)
    return tree | {"name": name} if name and len(content.roots) == 1 else tree
