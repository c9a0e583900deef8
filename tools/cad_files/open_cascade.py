"""Reads CAD files by Open CASCADE: what each holds, a JSON line for each.

    python -m tools.cad_files.open_cascade FILE …

Each file is read in a process of its own, with a limit of time, because damaged files let Open
CASCADE crash or hang; then the line has a `fault`. Lengths are in millimetres.

Only a Python in which cadquery-ocp is installed can run this program.
"""

import json
import sys
from typing import Any

from OCP.collections import Sequence_TCollection_AsciiString, Sequence_TDF_Label
from OCP.IFSelect import IFSelect_RetDone
from OCP.IGESCAFControl import IGESCAFControl_Reader
from OCP.IGESControl import IGESControl_Controller
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDocStd import TDocStd_Document
from OCP.XCAFApp import XCAFApp_Application
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from tools.cad_files.apart import call_apart
from tools.cad_files.measuring import measure

SECONDS = 120
"""The longest time for a file."""


def read(path: str) -> dict[str, Any]:
    """The content of a STEP or IGES file, as counts and measures."""
    document = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    is_iges = path.lower().endswith((".igs", ".iges"))
    if is_iges:
        IGESControl_Controller.Init_s()
    reader = IGESCAFControl_Reader() if is_iges else STEPCAFControl_Reader()
    if reader.ReadFile(path) != IFSelect_RetDone or not reader.Transfer(document):
        return {"fault": "not read"}
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    free = Sequence_TDF_Label()
    shapes.GetFreeShapes(free)
    if not free.Length():
        return {"faces": 0, "solids": 0, "shells": 0, "volumes": [], "area": 0, "units": []}
    units: list[str] = []
    if not is_iges:
        names = [Sequence_TCollection_AsciiString() for _ in range(3)]
        reader.ChangeReader().FileUnits(*names)
        units = [names[0].Value(number + 1).ToCString() for number in range(names[0].Length())]
    return {**measure(shapes.GetOneShape()), "units": units}


if __name__ == "__main__":
    for each in sys.argv[1:]:
        print(json.dumps({"file": each, **call_apart(read, each, SECONDS)}), flush=True)
