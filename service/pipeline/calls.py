"""The calls that make one file from one document, as a table: the model, the formats, the plan.

The command line and jobs compute with this table; each route of HTTP calls the same plan.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any, TypeVar

from service.decoders.format import DEFAULT_FILE_LIMITS, FileLimits
from service.encoders.cad.format import DefinitionFormat, WritingReport, WrittenFile
from service.encoders.cad.registry import CONVERSION_FORMATS
from service.encoders.format import Content, FileFormat
from service.encoders.png import PNG
from service.encoders.polylines.registry import CURVE_FORMATS, SECTION_FORMATS
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.mesh.mesh import MeshReport
from service.errors import InvalidRequest, Issue
from service.pipeline.cad_files import plan_cad_file
from service.pipeline.check import plan_check
from service.pipeline.cost import Work
from service.pipeline.documents import plan_conversion
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.measure import plan_measure
from service.pipeline.mesh import MeshFile, plan_mesh, select_encode_options
from service.pipeline.mesh_files import plan_file_check, plan_given_mesh
from service.pipeline.picture import plan_picture
from service.pipeline.polylines import plan_curve, plan_sections
from service.pipeline.queries import plan_intersect, plan_points, plan_project
from service.schemas.check import CheckRequest
from service.schemas.convert import ConvertRequest
from service.schemas.curves import CurveRequest
from service.schemas.document import DEFAULT_LIMITS as DEFAULT_DOCUMENT_LIMITS
from service.schemas.document import DocumentLimits
from service.schemas.fields import RequestModel
from service.schemas.intersect import IntersectRequest
from service.schemas.options import MeshOptionFields
from service.schemas.pictures import PictureFields, PictureRequest
from service.schemas.queries import MeasureRequest, PointsRequest, ProjectRequest
from service.schemas.request import MeshRequest
from service.surface.convert.nets import SizeLimits
from service.surface.sizes import SurfaceKind

JSON: FileFormat = BY_NAME["json"]
"""The format of calls that have no other, and the default of those that have."""

AnyFormat = TypeVar("AnyFormat", bound=FileFormat)


@dataclass(frozen=True, slots=True)
class CallLimits:
    """The limits of a request's document, of its result, and of a file that has its surface."""

    document: DocumentLimits = DEFAULT_DOCUMENT_LIMITS
    result: Limits = DEFAULT_LIMITS
    file: FileLimits = DEFAULT_FILE_LIMITS


@dataclass(frozen=True, eq=False, slots=True)
class File:
    """The result of a call.

    Attributes
    ----------
    content : Content
    name : str
        The name of the surface; empty if the result has none.
    report : MeshReport or None
        The report on a mesh; None for other results.
    reading : Mapping or None
        The report of reading the file that has the surface.
    writing : WritingReport or None
        The report of writing a file of definitions.
    """

    content: Content
    name: str = ""
    report: MeshReport | None = None
    reading: Mapping[str, Any] | None = None
    writing: WritingReport | None = None


@dataclass(frozen=True, slots=True)
class Call:
    """A call that makes a file from a document.

    Attributes
    ----------
    path : str
        The path of the URL to which the document is posted.
    model : type
        The model of the document.
    formats : sequence of FileFormat
        The formats of the file.
    plan : callable
        Plans the work, from a request of the model, a format of `formats` and the limits.
    reads_files : bool
        Whether the surface may be a file, with the other fields in the query.
    """

    path: str
    model: type[RequestModel]
    plan: Callable[[Any, Any, CallLimits], Work[File]]
    formats: Sequence[FileFormat] = (JSON,)
    reads_files: bool = False

    @property
    def default_format(self) -> FileFormat:
        """The format if the caller names none: JSON, or the only one."""
        of_json = (fmt for fmt in self.formats if fmt.name == JSON.name)
        return next(of_json, self.formats[0])


def find_format(name: str, formats: Sequence[AnyFormat]) -> AnyFormat:
    """The format of `formats` with this name.

    Raises
    ------
    InvalidRequest
        No format has this name; the pointer is `/format`.
    """
    for fmt in formats:
        if fmt.name == name:
            return fmt
    code, message, got = "unknown_format", "No format has this name.", "an unknown name"
    if name in BY_NAME:
        code, got = "unsupported_by_format", "a format for surfaces"
        message = f"The format {name} cannot store this result."
    needed = "one of " + ", ".join(fmt.name for fmt in formats)
    raise InvalidRequest(Issue(code, message, "/format", got, needed))


def plan_mesh_file(
    surface: SurfaceKind, options: MeshOptionFields, fmt: Any, limits: CallLimits
) -> Work[File]:
    """Plan the mesh of a surface with the options of a body or a query."""
    encode = select_encode_options(options)
    work = plan_mesh(surface, options.mesh_options(), fmt, encode, limits.result)
    return _convert(work, _take_mesh_file)


def plan_picture_file(
    surface: SurfaceKind, options: PictureFields, limits: CallLimits
) -> Work[File]:
    """Plan the picture of a surface with the options of a body or a query."""
    work = plan_picture(surface, options.picture_options(), limits.result)
    return _convert(work, partial(File, name=surface.name))


def _plan_mesh(request: MeshRequest, fmt: Any, limits: CallLimits) -> Work[File]:
    return plan_mesh_file(request.to_surface(), request, fmt, limits)


def _plan_points(request: PointsRequest, _: Any, limits: CallLimits) -> Work[File]:
    return _convert(plan_points(request.to_surface(), request.to_query(), limits.result), File)


def _plan_curve(request: CurveRequest, fmt: Any, limits: CallLimits) -> Work[File]:
    curve = request.to_curve()
    work = plan_curve(curve, request.curve_options(), fmt, limits.result)
    return _convert(work, partial(File, name=curve.name))


def _plan_project(request: ProjectRequest, _: Any, limits: CallLimits) -> Work[File]:
    return _convert(plan_project(request.to_shape(), request.to_query(), limits.result), File)


def _plan_intersect(request: IntersectRequest, fmt: Any, limits: CallLimits) -> Work[File]:
    surface = request.to_surface()
    if request.planes is not None:
        work = plan_sections(surface, request.to_sections(), fmt, limits.result)
        return _convert(work, partial(File, name=surface.name))
    if fmt.name != JSON.name:
        message, got = "Hits of rays are written as JSON.", "a format of sections"
        raise InvalidRequest(Issue("unsupported_by_format", message, "/format", got, "json"))
    return _convert(plan_intersect(surface, request.to_query(), limits.result), File)


def _plan_image(request: PictureRequest, _: Any, limits: CallLimits) -> Work[File]:
    return plan_picture_file(request.to_surface(), request, limits)


def _plan_measure(request: MeasureRequest, _: Any, limits: CallLimits) -> Work[File]:
    return _convert(plan_measure(request.to_surface(), request.to_query(), limits.result), File)


def _plan_check(request: CheckRequest, _: Any, limits: CallLimits) -> Work[File]:
    mesh = request.to_mesh()
    if mesh is None:
        reading = plan_given_mesh(request, limits.document, limits.file, limits.result)
        return _convert(plan_file_check(request, reading, limits.result), File)
    work = plan_check(request.to_surface(), mesh, request.to_query(), limits.result)
    return _convert(work, File)


def _plan_conversion(request: ConvertRequest, fmt: Any, limits: CallLimits) -> Work[File]:
    allowed = SizeLimits(limits.document.max_control_points, limits.document.max_degree)
    operations = request.to_operations()
    surface, reading = request.to_surface(), request.reading
    if isinstance(fmt, DefinitionFormat):
        file_work = plan_cad_file(surface, operations, allowed, fmt, limits.result)
        return _convert(file_work, partial(_take_written_file, surface.name))
    return _convert(plan_conversion(surface, operations, allowed, limits.result, reading), File)


def _take_written_file(name: str, file: WrittenFile) -> File:
    return File(file.content, name, writing=file.report)


def _take_mesh_file(file: MeshFile) -> File:
    return File(file.content, file.name, file.report)


def _convert(work: Work[Any], to_file: Callable[[Any], File]) -> Work[File]:
    """The work whose result is the file that `to_file` makes of the result of `work`."""
    return Work(work.cost, lambda: to_file(work.run()))


CALLS: Mapping[str, Call] = MappingProxyType(
    {
        call.path: call
        for call in (
            Call("/v1/mesh", MeshRequest, _plan_mesh, FORMATS, reads_files=True),
            Call("/v1/image", PictureRequest, _plan_image, (PNG,), reads_files=True),
            Call("/v1/points", PointsRequest, _plan_points),
            Call("/v1/curve", CurveRequest, _plan_curve, CURVE_FORMATS),
            Call("/v1/project", ProjectRequest, _plan_project),
            Call("/v1/intersect", IntersectRequest, _plan_intersect, SECTION_FORMATS),
            Call("/v1/measure", MeasureRequest, _plan_measure, reads_files=True),
            Call("/v1/check", CheckRequest, _plan_check),
            Call(
                "/v1/convert",
                ConvertRequest,
                _plan_conversion,
                CONVERSION_FORMATS,
                reads_files=True,
            ),
        )
    }
)
"""All calls, by path."""
