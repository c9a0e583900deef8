"""The tree of a file: which products and representations hold which others, and where roots are.

A node is a product with its representations, or a representation without a product. Links place a
node in another one: occurrences in assemblies, mapped items, and representations that are related
by a transformation.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from service.decoders.step.entities import Entities
from service.decoders.step.faults import Fault
from service.decoders.step.instances import COMPLEX
from service.decoders.step.products import OCCURRENCE, Occurrence, Products
from service.decoders.step.records import as_reference, as_text
from service.decoders.step.representations import Representations, is_representation
from service.decoders.step.tally import Tally

LinkKind: TypeAlias = Literal["related", "mapped", "plain"]

MAPPED = "MAPPED_ITEM"


@dataclass(frozen=True, slots=True)
class Link:
    """One node in another.

    Attributes
    ----------
    kind : str
        `related`: `source` is a relationship of representations with a transformation;
        `mapped`: `source` is a mapped item; `plain`: without a transformation.
    child : int
        The number of a node.
    name : str
    source : int
    styled : int
        The entity whose style colours this instance.
    within : int
        The representation that has the mapped item.
    """

    kind: LinkKind
    child: int
    name: str
    source: int
    styled: int
    within: int = -1


@dataclass(slots=True)
class Node:
    """A product, or a representation without one.

    Attributes
    ----------
    number : int
    name : str
    representations : dict
        The numbers of those whose items are its own, as keys.
    links : list of Link
    """

    number: int
    name: str
    representations: dict[int, None] = field(default_factory=dict)
    links: list[Link] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Structure:
    """The nodes of a file, without circles, in the order in which the tree has them first.

    Attributes
    ----------
    nodes : dict of Node
        By number.
    roots : tuple of int
    owners : dict
        The node of each representation.
    """

    nodes: dict[int, Node]
    roots: tuple[int, ...]
    owners: dict[int, int]


def find_structure(
    entities: Entities, products: Products, representations: Representations, tally: Tally
) -> Structure:
    """The tree of a file.

    Raises
    ------
    TooLarge
        `too_many_members`: more products than a group may have members.
    """
    builder = _Builder(entities, representations, tally)
    builder.add_products(products)
    if not builder.nodes:
        builder.add_representations()
    builder.add_mapped_items()
    builder.add_occurrences(products.occurrences)
    builder.add_related(products.occurrences)
    roots = _order(builder.nodes, tally)
    return Structure(builder.nodes, roots, builder.owners)


class _Builder:
    def __init__(self, entities: Entities, representations: Representations, tally: Tally) -> None:
        self._entities = entities
        self._representations = representations
        self._tally = tally
        self.nodes: dict[int, Node] = {}
        self.owners: dict[int, int] = {}

    def add_products(self, products: Products) -> None:
        self._entities.budget.check_members(len(products.products))
        for product in products.products.values():
            node = self.nodes[product.number] = Node(product.number, product.name)
            for number in product.representations:
                if self._entities.has(number):
                    claimed = self._representations.claim(number, product.number, self.owners)
                    node.representations |= dict.fromkeys(claimed)

    def add_representations(self) -> None:
        """In a file without products: nodes of all representations."""
        keywords = filter(is_representation, self._entities.instances.keywords)
        rows = self._entities.instances.rows_of(*keywords)
        self._entities.budget.check_members(len(rows))
        for row in rows:
            self._find_node(int(self._entities.instances.numbers[row]))

    def add_mapped_items(self) -> None:
        """Link what is mapped to the nodes in whose representations it is."""
        pending = list(self.nodes.values())
        while pending:
            node = pending.pop()
            for item, within in list(self._mapped_items(node)):
                known = len(self.nodes)
                try:
                    child, name = self._read_mapped(item, node)
                except Fault:
                    self._tally.skip(MAPPED)
                    continue
                if len(self.nodes) > known:
                    pending.append(self.nodes[child])
                node.links.append(Link("mapped", child, name, item, item, within))

    def add_occurrences(self, occurrences: Iterable[Occurrence]) -> None:
        """Link the products of assemblies.

        An occurrence without a placement of its own is the same as a mapped item, if the assembly
        has one of this product.
        """
        is_mapped = {
            (node.number, link.child) for node in self.nodes.values() for link in node.links
        }
        for each in occurrences:
            node = self.nodes[each.parent]
            relationship = self._representations.placed.get(each.relationship or -1)
            if relationship is not None:
                styled = each.placement or each.number
                link = Link("related", each.child, each.name, relationship.number, styled)
            elif (each.parent, each.child) in is_mapped:
                continue
            else:
                if each.placement is not None:
                    self._tally.skip("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION")
                link = Link("plain", each.child, each.name, each.number, each.number)
            node.links.append(link)

    def add_related(self, occurrences: Iterable[Occurrence]) -> None:
        """Link representations that are placed in others without an occurrence of a product."""
        used = {each.relationship for each in occurrences}
        pairs = {(each.parent, each.child) for each in occurrences}
        for number, each in self._representations.placed.items():
            parent = self.owners.get(each.second)
            if number in used or parent is None or not self._entities.has(each.first):
                continue
            child = self._find_node(each.first, parent)
            if (parent, child) not in pairs:
                self.nodes[parent].links.append(Link("related", child, "", number, number))

    def _mapped_items(self, node: Node) -> Iterator[tuple[int, int]]:
        """Each mapped item of a node, with the representation that has it."""
        instances = self._entities.instances
        for number in node.representations:
            try:
                items = self._representations.read(number).items
            except Fault:
                continue
            for item in items:
                row = instances.find(item)
                keyword = instances.keyword(row) if row >= 0 else ""
                if keyword == MAPPED or (keyword == COMPLEX and self._is_mapped(item)):
                    yield item, number

    def _is_mapped(self, number: int) -> bool:
        try:
            return self._entities.read(number).keyword == MAPPED
        except Fault:
            return False

    def _read_mapped(self, number: int, node: Node) -> tuple[int, str]:
        """The node that an item maps, and the name of the item."""
        item = self._entities.read_as(number, MAPPED)
        source = self._entities.read_as(as_reference(item.parameter(1)), "REPRESENTATION_MAP")
        representation = as_reference(source.parameter(1))
        self._representations.read(representation)
        return self._find_node(representation, node.number), as_text(item.parameter(0))

    def _find_node(self, representation: int, parent: int | None = None) -> int:
        """The node of a representation; within its own product it becomes a node of its own."""
        owner = self.owners.get(representation)
        if owner is None:
            node = self.nodes[representation] = Node(representation, self._name(representation))
            node.representations |= dict.fromkeys(
                self._representations.claim(representation, representation, self.owners)
            )
            return representation
        if owner == parent and owner != representation:
            node = self.nodes[representation] = Node(representation, self._name(representation))
            node.representations[representation] = None
            self.owners[representation] = representation
            self.nodes[owner].representations.pop(representation, None)
            return representation
        return owner

    def _name(self, representation: int) -> str:
        try:
            return self._representations.read(representation).name
        except Fault:
            return ""


def _order(nodes: dict[int, Node], tally: Tally) -> tuple[int, ...]:
    """Order nodes as the tree has them, in place, without links that close circles; find roots.

    A node that is in a circle, and in no tree of another root, is a root too.
    """
    children = {link.child for node in nodes.values() for link in node.links}
    candidates = [*(number for number in nodes if number not in children), *nodes]
    is_open: dict[int, bool] = {}  # false when all that is below has been seen
    roots: list[int] = []
    closing: set[int] = set()  # identities of links that close circles
    for root in candidates:
        if root in is_open:
            continue
        roots.append(root)
        is_open[root] = True
        stack = [(root, iter(nodes[root].links))]
        while stack:
            number, links = stack[-1]
            for link in links:
                state = is_open.get(link.child)
                if state:
                    closing.add(id(link))
                    tally.skip(MAPPED if link.kind == "mapped" else OCCURRENCE)
                elif state is None:
                    is_open[link.child] = True
                    stack.append((link.child, iter(nodes[link.child].links)))
                    break
            else:
                stack.pop()
                is_open[number] = False
    for node in nodes.values() if closing else ():
        node.links = [link for link in node.links if id(link) not in closing]
    ordered = {number: nodes[number] for number in is_open}
    nodes.clear()
    nodes.update(ordered)
    return tuple(roots)
