"""Open CASCADE turns a CAD file into a GLB, in a Python of its own.

The program reads lines: the path of a STEP file, the path of the GLB, and the deflection. For each
it prints the seconds of CPU time to read, to mesh on one thread, where only the deviation counts,
and to write; and the number of faces. Its import is not counted.

    python -m tools.benchmarks.cad_files_worker FOLDER

writes `panel_pcurves.step` and `panel_edges.step` to the folder first, with and without parameter
curves.
"""

import sys
import time
from itertools import pairwise
from pathlib import Path

from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.collections import IndexedDataMap_TCollection_AsciiString_TCollection_AsciiString
from OCP.Message import Message_ProgressRange
from OCP.RWGltf import RWGltf_CafWriter
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_AsciiString, TCollection_ExtendedString
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_FACE
from OCP.XCAFApp import XCAFApp_Application
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from tools.cad_files.measuring import find
from tools.cad_files.shapes import panel
from tools.cad_files.write import write_step

ANGLE = 10.0
"""The angular deflection in radians: so large that it has no effect."""


def convert(source: str, target: str, deflection: float) -> tuple[list[float], int]:
    """The seconds to read, to mesh and to write, and the number of faces."""
    times = [time.process_time()]
    document = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    reader.SetColorMode(True)
    reader.ReadFile(source)
    reader.Transfer(document)
    shape = XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetOneShape()
    times.append(time.process_time())
    BRepMesh_IncrementalMesh(shape, deflection, False, ANGLE, False)
    times.append(time.process_time())
    writer = RWGltf_CafWriter(TCollection_AsciiString(target), True)
    information = IndexedDataMap_TCollection_AsciiString_TCollection_AsciiString()
    writer.Perform(document, information, Message_ProgressRange())
    times.append(time.process_time())
    seconds = [after - before for before, after in pairwise(times)]
    return seconds, len(find(shape, TopAbs_FACE))


def main(folder: str) -> None:
    """Writes the files, then converts files until the input ends."""
    for name, pcurves in (("panel_pcurves", 1), ("panel_edges", 0)):
        write_step(Path(folder) / f"{name}.step", panel(), "AP214IS", "MM", pcurves)
    print("ready", flush=True)
    for line in sys.stdin:
        source, target, deflection = line.split()
        seconds, faces = convert(source, target, float(deflection))
        print("result", *seconds, faces, flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
