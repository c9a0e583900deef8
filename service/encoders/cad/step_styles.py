"""Colours of solids and faces in STEP files.

References
----------
ISO 10303-46, Visual presentation: styled_item, surface_style_usage.
"""

from service.encoders.cad.step_records import Records, write_real, write_references
from service.surface.lowered import Color


class StyleWriter:
    """Writes the styles of items, one for each colour.

    Attributes
    ----------
    styled : list of int
        The numbers of the items with a style.
    """

    def __init__(self, records: Records) -> None:
        self._records = records
        self._styles: dict[Color, int] = {}
        self.styled: list[int] = []

    def add(self, item: int, color: Color) -> None:
        """Give an item a colour; a face in place of the colour of its solid."""
        style = self._styles.get(color)
        if style is None:
            style = self._styles[color] = self._write_style(color)
        self.styled.append(self._records.add(f"STYLED_ITEM('',(#{style}),#{item})"))

    def _write_style(self, color: Color) -> int:
        """The presentation of surfaces in a colour."""
        add = self._records.add
        *rgb, opacity = color
        number = add(f"COLOUR_RGB('',{','.join(map(write_real, rgb))})")
        fill = add(f"FILL_AREA_STYLE_COLOUR('',#{number})")
        area = add(f"FILL_AREA_STYLE('',(#{fill}))")
        styles = [add(f"SURFACE_STYLE_FILL_AREA(#{area})")]
        if opacity < 1:
            clear = add(f"SURFACE_STYLE_TRANSPARENT({write_real(1.0 - opacity)})")
            styles.append(
                add(
                    "SURFACE_STYLE_RENDERING_WITH_PROPERTIES(.NORMAL_SHADING.,"
                    f"#{number},(#{clear}))"
                )
            )
        side = add(f"SURFACE_SIDE_STYLE('',{write_references(styles)})")
        usage = add(f"SURFACE_STYLE_USAGE(.BOTH.,#{side})")
        return add(f"PRESENTATION_STYLE_ASSIGNMENT((#{usage}))")

    def finish(self, context: int) -> None:
        """Write the representation of all styles, in a context of shapes."""
        self._records.add(
            "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',"
            f"{write_references(self.styled)},#{context})"
        )
