"""Reads STEP and IGES files by Open CASCADE: measures, and the tree of products; JSON lines.

    python -m tools.cad_files.assemblies FILE …

A line has the measures of the whole shape in millimetres, and its `tree`: for each instance its
name, the name, colour and opacity of its product, its volume and centre, and the instances in it.
Only a Python in which cadquery-ocp is installed can run this program.
"""

import json
import sys
from typing import Any

from OCP.BRepGProp import BRepGProp
from OCP.collections import Sequence_TDF_Label
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_RetDone
from OCP.IGESCAFControl import IGESCAFControl_Reader
from OCP.IGESControl import IGESControl_Controller
from OCP.Quantity import Quantity_ColorRGBA, Quantity_TOC_sRGB
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDF import TDF_AttributeIterator, TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.XCAFApp import XCAFApp_Application
from OCP.XCAFDoc import XCAFDoc_ColorType, XCAFDoc_DocumentTool

from tools.cad_files.measuring import ACCURACY, measure

KINDS = (XCAFDoc_ColorType.XCAFDoc_ColorSurf, XCAFDoc_ColorType.XCAFDoc_ColorGen)
"""The kinds of colours that surfaces have, the first one first."""


def read(path: str) -> dict[str, Any]:
    """The measures and the tree of one file."""
    document = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    is_iges = path.endswith(".igs")
    if is_iges:
        IGESControl_Controller.Init_s()
    reader = IGESCAFControl_Reader() if is_iges else STEPCAFControl_Reader()
    reader.SetColorMode(True)
    reader.SetNameMode(True)
    if reader.ReadFile(path) != IFSelect_RetDone or not reader.Transfer(document):
        return {"error": "not read"}
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    free = Sequence_TDF_Label()
    shapes.GetFreeShapes(free)
    whole = measure(shapes.GetOneShape())
    tree = [describe(shapes, free.Value(k + 1)) for k in range(free.Length())]
    return {**whole, "tree": tree}


def describe(shapes: Any, label: Any) -> dict[str, Any]:
    """An instance, or a shape at the root, with all instances in it."""
    product = label
    if shapes.IsReference_s(label):
        product = TDF_Label()
        shapes.GetReferredShape_s(label, product)
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(shapes.GetShape_s(label), properties, ACCURACY, False, False)
    centre = properties.CentreOfMass()
    parts = Sequence_TDF_Label()
    shapes.GetComponents_s(product, parts)
    faces = Sequence_TDF_Label()
    shapes.GetSubShapes_s(product, faces)
    colors = (find_color(faces.Value(k + 1)) for k in range(faces.Length()))
    return {
        "name": find_name(label),
        "product": find_name(product),
        "color": find_color(product),
        "faces": sorted(color for color in colors if color is not None),
        "volume": properties.Mass(),
        "centre": [centre.X(), centre.Y(), centre.Z()],
        "parts": [describe(shapes, parts.Value(k + 1)) for k in range(parts.Length())],
    }


def find_name(label: Any) -> str:
    """The name of a label. `FindAttribute` would free it twice and crash."""
    attributes = TDF_AttributeIterator(label)
    while attributes.More():
        attribute = attributes.Value()
        if attribute.DynamicType().Name() == "TDataStd_Name":
            return str(attribute.Get().ToExtString())
        attributes.Next()
    return ""


def find_color(label: Any) -> list[float] | None:
    """The colour of a label: sRGB and opacity."""
    color = Quantity_ColorRGBA()
    tool = XCAFDoc_DocumentTool.ColorTool_s(label)
    for kind in KINDS:
        if tool.GetColor_s(label, kind, color):
            rgb = color.GetRGB().Values(Quantity_TOC_sRGB)
            return [*(round(float(share), 4) for share in rgb), round(color.Alpha(), 4)]
    return None


if __name__ == "__main__":
    for each in sys.argv[1:]:
        print(json.dumps({"file": each, **read(each)}), flush=True)
