"""The products of a CAD file that have faces, and how much each of them adds to a group.

What a product holds stands in a group once for each of its instances. So the members and the placed
faces are counted before any member is made: 40 levels of two instances each are 2^40 parts, in a
file of 40 kB.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.brep_document import write_color
from service.decoders.cad.content import CadContent, FileLimits, Part, Placement
from service.decoders.cad.names import NameCleaner
from service.errors import InvalidRequest, Issue, TooLarge, count_nouns

MAX_DEPTH = 100
"""The most levels of members of a group, one below another."""

MAX_SCALING_RATIO, LEAST_SCALING = 1e6, float(np.finfo(np.float32).tiny)
"""A placement may scale one direction at most this factor more than another, and none less than
this; other placements flatten bodies, and the service refuses them."""


@dataclass(frozen=True, eq=False, slots=True)
class Instance:
    """A placement of a product that has faces; all values are as in the document.

    If its name is another than that of its product, and the product has a member, that is one
    below it: so both names stay (`is_above_product`).
    """

    product: int
    name: str
    matrix: FloatArray | None
    color: list[float] | None
    is_above_product: bool


@dataclass(frozen=True, eq=False, slots=True)
class Product:
    """A definition: its parts with faces and its instances with faces.

    `members` and `faces` count what one instance of it adds to the group; both stop at a number
    that is beyond every limit. `depth` counts the levels of these members.
    """

    name: str
    parts: tuple[Part, ...]
    instances: tuple[Instance, ...]
    members: int
    faces: int
    depth: int

    @property
    def is_part(self) -> bool:
        """Whether it is one part and nothing else, so that it needs no member of its own."""
        return len(self.parts) == 1 and not self.instances


BEYOND = 2**62
"""A count that is beyond every limit; larger counts become this one."""


def count_products(content: CadContent, names: NameCleaner) -> tuple[dict[int, Product], int]:
    """All products below the roots, by number, and how many placements were left out."""
    products: dict[int, Product] = {}
    skipped = 0
    stack = [root.definition for root in reversed(content.roots)]
    begun: set[int] = set()
    while stack:
        number = stack[-1]
        definition = content.definitions[number]
        below = {each.definition for each in definition.placements} - products.keys()
        if below and number not in products:
            if number in begun:  # it is below itself
                raise _too_deep()
            begun.add(number)
            stack += sorted(below, reverse=True)
            continue
        stack.pop()
        if number in products:
            continue
        instances, count = find_instances(definition.placements, products, names)
        skipped += count
        parts = tuple(part for part in definition.parts if part.faces)
        inside = [products[instance.product] for instance in instances]
        above = [instance.is_above_product for instance in instances]
        members = len(parts) + sum(above) + sum(product.members for product in inside)
        faces = sum(len(part.faces) for part in parts) + sum(product.faces for product in inside)
        depth = find_depth(instances, products)
        if instances or len(parts) > 1:  # a member of its own, above those of its parts
            members, depth = members + 1, max(1, depth)
        if depth >= MAX_DEPTH:
            raise _too_deep()
        name = names.clean(definition.name)
        products[number] = Product(
            name, parts, instances, _bound(members), _bound(faces), depth + 1
        )
    return products, skipped


def find_depth(instances: Sequence[Instance], products: Mapping[int, Product]) -> int:
    """The levels of members of these instances.

    Raises
    ------
    InvalidRequest
        `too_deep`.
    """
    depths = [products[each.product].depth + each.is_above_product for each in instances]
    depth = max(depths, default=0)
    if depth > MAX_DEPTH:
        raise _too_deep()
    return depth


def _too_deep() -> InvalidRequest:
    message = "Products of the file are nested more deeply than this service reads."
    got, needed = f"more than {MAX_DEPTH} levels", f"at most {MAX_DEPTH}"
    return InvalidRequest(Issue("too_deep", message, "", got, needed))


def find_instances(
    placements: Sequence[Placement], products: dict[int, Product], names: NameCleaner
) -> tuple[tuple[Instance, ...], int]:
    """The placements of products with faces, and the number of those that flatten bodies."""
    used = [each for each in placements if products[each.definition].members]
    given = [each.matrix for each in used if each.matrix is not None]
    checks = iter(_check_matrices(np.array(given, np.float64).reshape(-1, 4, 4)))
    instances: list[Instance] = []
    for placement in used:
        is_valid, is_moved = (True, False) if placement.matrix is None else next(checks)
        if is_valid:
            product, name = products[placement.definition], names.clean(placement.name)
            instances.append(
                Instance(
                    placement.definition,
                    name or product.name,
                    placement.matrix if is_moved else None,
                    None if placement.color is None else write_color(placement.color),
                    not product.is_part and name != "" and product.name not in ("", name),
                )
            )
    return tuple(instances), len(used) - len(instances)


def _check_matrices(matrices: FloatArray) -> Iterator[tuple[bool, bool]]:
    """For each matrix, (M, 4, 4): whether it flattens no body, and whether it moves any."""
    is_affine = np.isfinite(matrices).all(axis=(1, 2))
    is_affine &= (matrices[:, 3] == [0, 0, 0, 1]).all(axis=1)
    linear = np.where(is_affine[:, np.newaxis, np.newaxis], matrices[:, :3, :3], 0)
    scalings = np.linalg.svd(linear, compute_uv=False)
    largest, least = scalings[:, 0], scalings[:, 2]
    is_valid = (least >= LEAST_SCALING) & (largest <= MAX_SCALING_RATIO * least)
    is_moved = (matrices != np.eye(4)).any(axis=(1, 2))
    return zip(is_valid.tolist(), is_moved.tolist(), strict=True)


def check_size(roots: Sequence[Instance], products: dict[int, Product], limits: FileLimits) -> None:
    """Refuse a group that would be too large."""
    parts = {id(part): part for product in products.values() for part in product.parts}
    faces = sum(len(part.faces) for part in parts.values())
    placed = [products[root.product] for root in roots]
    above = sum(root.is_above_product for root in roots)
    members = _bound(above + sum(product.members for product in placed))
    placed_faces = _bound(sum(product.faces for product in placed))
    counts = (
        (faces, "faces", limits.max_faces, "MAX_FACES"),
        (len(parts), "parts", limits.max_definitions, "MAX_MEMBERS"),
        (members, "members", limits.max_members, "MAX_MEMBERS"),
        (placed_faces, "placed faces", limits.max_placed_faces, "MAX_PLACED_FACES"),
    )
    for count, noun, limit, setting in counts:
        if count > limit:
            got = count_nouns(count, noun) if count < BEYOND else f"more than {BEYOND} {noun}"
            raise TooLarge(
                Issue(
                    f"too_many_{noun.replace(' ', '_')}",
                    f"The file has more {noun} than this service takes.",
                    "",
                    got,
                    f"at most {limit} (SURFACE_{setting})",
                )
            )


def _bound(count: int) -> int:
    return min(count, BEYOND)
