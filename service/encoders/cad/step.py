"""STEP files of the protocol AP214: products, instances, shapes, colours and units.

A definition is a product with the shape of its bodies. A node of the tree of instances that has
nodes below it is a product, an assembly; equal nodes are one product. A file of one definition
without instances is this product alone.

The text is the same for the same model: its time stamp is fixed. Coordinates are those of the
model, whatever its vertical axis: STEP has none.

References
----------
ISO 10303-214, Core data for automotive mechanical design processes; ISO 10303-44, Product structure
configuration (4.3, next assembly usage occurrence); ISO 10303-46, Visual presentation.
"""

from collections.abc import Container, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray
from service.encoders.cad.assembly import Assembly, Definition, assemble
from service.encoders.cad.bounds import bound_step
from service.encoders.cad.format import Allow, WrittenFile
from service.encoders.cad.step_body import BodyItem, write_body
from service.encoders.cad.step_geometry import write_axes
from service.encoders.cad.step_records import Records, write_real, write_references, write_string
from service.encoders.cad.step_styles import StyleWriter
from service.encoders.cad.step_units import write_unit
from service.encoders.format import pack
from service.surface.lowered import Model

SCHEMA = "AUTOMOTIVE_DESIGN { 1 0 10303 214 3 1 1 1 }"

LEAST_UNCERTAINTY = 1e-9
"""The uncertainty, in units of the model, of shapes that state none."""

ASSUMED = "One unit of the model is written as 1 mm, because the model has no unit."
"""The text in the head of a file if the model has no unit."""


def encode(model: Model, metres_per_unit: float | None, allow: Allow) -> WrittenFile:
    """The STEP file of a model; raises the errors of `assemble`, and those of `allow`."""
    assembly = assemble(model, metres_per_unit)
    allow(bound_step(assembly))
    chunks = _Writer(assembly).write()
    content = pack((_write_head(assembly), *chunks, _TAIL))
    return WrittenFile(content, assembly.report())


_TAIL = b"ENDSEC;\nEND-ISO-10303-21;\n"


def _write_head(assembly: Assembly) -> bytes:
    """All before the first instance."""
    about = write_string(ASSUMED if assembly.is_unit_assumed else "")
    lines = (
        "ISO-10303-21;",
        "HEADER;",
        f"FILE_DESCRIPTION(({about}),'2;1');",
        f"FILE_NAME({write_string(assembly.name)},'2000-01-01T00:00:00',(''),(''),"
        "'Surface Service','Surface Service','');",
        f"FILE_SCHEMA(('{SCHEMA}'));",
        "ENDSEC;",
        "DATA;\n",
    )
    return "\n".join(lines).encode()


@dataclass(frozen=True, slots=True)
class _Product:
    """The numbers of a product's definition, of its representation, and of the axes of this."""

    definition: int
    representation: int
    origin: int


_Child: TypeAlias = tuple[int, str, FloatArray | None]
"""A placed product: its place in the list of products, its name, and its placement."""


class _Writer:
    """Writes the data section of one file."""

    def __init__(self, assembly: Assembly) -> None:
        self.assembly = assembly
        self.records = Records()
        self._styles = StyleWriter(self.records)
        self._contexts: dict[float, int] = {}
        self._product_count = 0

    def write(self) -> Sequence[bytes]:
        """The text of the section in several chunks."""
        self._write_frame()
        own = [self._write_definition(each) for each in self.assembly.definitions]
        if self.assembly.instances:
            self._write_tree(own)
        if self._styles.styled:
            self._styles.finish(self._find_context(min(self._contexts)))
        return self.records.finish()

    def _write_frame(self) -> None:
        """The application, the contexts of products, and the units."""
        add = self.records.add
        application = add(
            "APPLICATION_CONTEXT('core data for automotive mechanical design processes')"
        )
        add(
            "APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,"
            f"#{application})"
        )
        self.product_context = add(f"PRODUCT_CONTEXT('',#{application},'mechanical')")
        self.design_context = add(
            f"PRODUCT_DEFINITION_CONTEXT('part definition',#{application},'design')"
        )
        length = write_unit(self.records, self.assembly.metres_per_unit)
        angle = add("(NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.))")
        solid_angle = add("(NAMED_UNIT(*) SI_UNIT($,.STERADIAN.) SOLID_ANGLE_UNIT())")
        self.length_unit = length
        self.units = write_references((length, angle, solid_angle))
        self.parameter_context = add(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(2) PARAMETRIC_REPRESENTATION_CONTEXT() "
            "REPRESENTATION_CONTEXT('2D SPACE',''))"
        )

    def _find_context(self, uncertainty: float) -> int:
        """The context of shapes with an uncertainty; it names the units."""
        if uncertainty not in self._contexts:
            measure = self.records.add(
                f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({write_real(uncertainty)}),"
                f"#{self.length_unit},'distance_accuracy_value','')"
            )
            self._contexts[uncertainty] = self.records.add(
                "(GEOMETRIC_REPRESENTATION_CONTEXT(3) "
                f"GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{measure})) "
                f"GLOBAL_UNIT_ASSIGNED_CONTEXT({self.units}) REPRESENTATION_CONTEXT('',''))"
            )
        return self._contexts[uncertainty]

    def _write_definition(self, definition: Definition) -> _Product:
        """The product of a definition, with the shape of its bodies."""
        items: list[BodyItem] = []
        uncertainty = 0.0
        for body in definition.transformed_bodies():
            context = self.parameter_context
            add_style = self._styles.add
            items.append(write_body(self.records, body, context, definition.color, add_style))
            uncertainty = max(uncertainty, body.uncertainty)
        kind = "MANIFOLD_SURFACE_SHAPE_REPRESENTATION"
        if all(item.is_solid for item in items):
            kind = "ADVANCED_BREP_SHAPE_REPRESENTATION"
        elif any(item.is_solid for item in items):
            kind = "SHAPE_REPRESENTATION"
        return self._write_product(
            definition.name, kind, [item.number for item in items], uncertainty
        )

    def _write_product(
        self, name: str, kind: str, items: Sequence[int], uncertainty: float
    ) -> _Product:
        """A product whose representation has some items."""
        add, text = self.records.add, write_string(name)
        self._product_count += 1
        product = add(f"PRODUCT('{self._product_count}',{text},'',(#{self.product_context}))")
        add(f"PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,(#{product}))")
        formation = add(f"PRODUCT_DEFINITION_FORMATION('','',#{product})")
        definition = add(f"PRODUCT_DEFINITION('','',#{formation},#{self.design_context})")
        shape = add(f"PRODUCT_DEFINITION_SHAPE('','',#{definition})")
        origin = self._write_placement(None)
        context = self._find_context(uncertainty or LEAST_UNCERTAINTY)
        listed = write_references((origin, *items))
        representation = add(f"{kind}('',{listed},#{context})")
        add(f"SHAPE_DEFINITION_REPRESENTATION(#{shape},#{representation})")
        return _Product(definition, representation, origin)

    def _write_placement(self, matrix: FloatArray | None) -> int:
        matrix = np.eye(4) if matrix is None else matrix
        return write_axes(self.records, matrix[:3, 3], matrix[:3, 2], matrix[:3, 0])

    def _write_tree(self, own: Sequence[_Product]) -> None:
        """The products of all nodes with nodes below them, and of the root.

        A node with one such node below it, not moved, is an instance of its product: both names
        stay. A node that is all of the file is its root.
        """
        instances, below = self.assembly.instances, self.assembly.list_below()
        made: dict[tuple[object, ...], int] = {}
        products = list(own)
        chosen = [-1] * len(instances)
        named: set[int] = set()  # nodes that give their name to a product
        # Nodes come after the nodes above them, so backwards all nodes below come first.
        for number in range(len(instances) - 1, -1, -1):
            instance = instances[number]
            if not below[number] and instance.definition is not None:
                chosen[number] = instance.definition
                continue
            children = [(chosen[k], instances[k].name, instances[k].matrix) for k in below[number]]
            if instance.definition is None and self._is_whole(below[number], named):
                chosen[number] = chosen[below[number][0]]
                continue
            named.add(number)
            if instance.definition is not None:
                children.insert(0, (instance.definition, instance.name, None))
            key = (
                instance.name,
                *(
                    (child, name, None if matrix is None else matrix.tobytes())
                    for child, name, matrix in children
                ),
            )
            if key not in made:
                made[key] = len(products)
                products.append(self._write_assembly(instance.name, children, products))
            chosen[number] = made[key]
        if self._is_whole(below[-1], named) and instances[0].name == self.assembly.name:
            return
        children = [(chosen[k], instances[k].name, instances[k].matrix) for k in below[-1]]
        self._write_assembly(self.assembly.name, children, products)

    def _is_whole(self, nodes: Sequence[int], named: Container[int]) -> bool:
        """Whether these are one node, which is not moved and gives its name to its product."""
        instances = self.assembly.instances
        return len(nodes) == 1 and nodes[0] in named and instances[nodes[0]].matrix is None

    def _write_assembly(
        self, name: str, children: Sequence[_Child], products: Sequence[_Product]
    ) -> _Product:
        """A product that consists of placed products."""
        placements = [self._write_placement(matrix) for _, _, matrix in children]
        uncertainty = min(self._contexts, default=0.0)
        whole = self._write_product(name, "SHAPE_REPRESENTATION", placements, uncertainty)
        add = self.records.add
        for number, ((child, title, _), placement) in enumerate(
            zip(children, placements, strict=True), start=1
        ):
            part = products[child]
            usage = add(
                f"NEXT_ASSEMBLY_USAGE_OCCURRENCE('{number}',{write_string(title)},'',"
                f"#{whole.definition},#{part.definition},$)"
            )
            move = add(f"ITEM_DEFINED_TRANSFORMATION('','',#{part.origin},#{placement})")
            relation = add(
                f"(REPRESENTATION_RELATIONSHIP('','',#{part.representation},"
                f"#{whole.representation}) REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION"
                f"(#{move}) SHAPE_REPRESENTATION_RELATIONSHIP())"
            )
            shape = add(f"PRODUCT_DEFINITION_SHAPE('','',#{usage})")
            add(f"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#{relation},#{shape})")
        return whole
