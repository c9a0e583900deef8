"""Reads CAD files by Open CASCADE: what each holds, a JSON line for each.

    python -m tools.cad_files.open_cascade FILE …

Each file is read in a process of its own, with a limit of time, because damaged files let Open
CASCADE crash or hang; then the line has an `error`. Lengths are in millimetres.

Only a Python in which cadquery-ocp is installed can run this program.
"""

import json
import os
import signal
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
        return {"error": "not read"}
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


def read_apart(path: str) -> dict[str, Any]:
    """The result of `read`, called in a forked process, which may crash."""
    source, target = os.pipe()
    process = os.fork()
    if process == 0:
        silence = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silence, 1)
        os.dup2(silence, 2)
        signal.alarm(SECONDS)
        try:
            result = read(path)
        except Exception as error:  # any error of the library is a result
            result = {"error": type(error).__name__}
        with os.fdopen(target, "w") as stream:
            json.dump(result, stream)
        os._exit(0)
    os.close(target)
    with os.fdopen(source) as stream:
        text = stream.read()
    status = os.waitpid(process, 0)[1]
    return json.loads(text) if text else {"error": f"ended with status {status}"}


if __name__ == "__main__":
    for each in sys.argv[1:]:
        print(json.dumps({"file": each, **read_apart(each)}), flush=True)
