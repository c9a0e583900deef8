"""Surface and options in, a mesh file out."""

import sys
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from service.encoders.format import EncodeOptions, Format, MeshSize
from service.engine.adaptive.accuracy import Accuracy
from service.engine.adaptive.aims import diagonal_of, stated
from service.engine.adaptive.limits import Effort
from service.engine.build import build, build_scene, lines_of
from service.engine.curvatures.stretches import with_stretches
from service.engine.deviation.bound import largest
from service.engine.gridded import gridded
from service.engine.mesh import Mesh, MeshReport
from service.engine.models import NOT_PATCHES, carrying
from service.engine.options import MeshOptions
from service.engine.scene import Scene, about_zero
from service.errors import InvalidRequest
from service.pipeline.budget import within_budget
from service.pipeline.certified import Certifier, Make, check_content, check_made
from service.pipeline.checks import (
    check_accuracy,
    check_bytes,
    check_curvatures,
    check_format,
    check_method,
    check_sweeps,
    check_vertices,
    check_wires,
)
from service.pipeline.foresight import Foreseen, foreseen
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.memory import check_lowering, model_bytes
from service.pipeline.mesh_memory import SHARE, certifying, meshing, most_certified
from service.pipeline.parametric import patches_of
from service.pipeline.prediction import Known, predict
from service.stopping import checkpoint
from service.surface.lowered import GroupModel, Model
from service.surface.sweep_model import SweepModel

PLAIN = EncodeOptions()

SEARCH = 2
"""How much more than one mesh the search for the one that keeps to a budget may take."""

FINEST, FINEST_SINGLE = 2.0**-38, 2.0**-20
"""Parts of the model's diagonal that no budget goes below: some times what rounding takes."""


class Lowerable(Protocol):
    """Whatever lowers to a model that can be meshed."""

    def lower(self) -> Model:
        """The surface as batches of Bézier patches, or as a group of such."""
        ...


@dataclass(frozen=True, eq=False, slots=True)
class Answer:
    """A file, and the report on the mesh in it, if there is one: exact patches have none."""

    content: bytes
    report: MeshReport | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Work:
    """A file that may be computed: everything is known of it but its bytes.

    `size` counts every copy of a surface in a group, `stored` what the format stores once once.
    `memory` are the bytes that the work takes at most, the model and the file included. A mesh by
    tolerance may have `affordable` triangles for that.
    """

    model: Model
    options: MeshOptions
    fmt: Format
    encode: EncodeOptions
    size: MeshSize
    stored: MeshSize
    limits: Limits = DEFAULT_LIMITS
    memory: int = 0
    affordable: int = sys.maxsize

    def run(self) -> bytes:
        """The file.

        Raises
        ------
        InvalidRequest, TooLarge
            If a tolerance cannot be met, or not within the limits.
        """
        return self.answer().content

    def answer(self) -> Answer:
        """The file, with what is known of it."""
        if self.encode.exact and self.fmt.encode_exact is not None:
            patches = patches_of(self.model)
            return Answer(self.fmt.encode_exact(patches, lines_of(patches, self.options)))
        accuracy = self.options.accuracy
        if accuracy is not None and accuracy.budgeted:
            finest = (FINEST_SINGLE if self.fmt.single else FINEST) * diagonal_of(self.model)
            effort = Effort(SEARCH * self.limits.max_multiplications)
            make = self._certifier(effort)
            made, content = within_budget(make, self._written, accuracy, finest, effort)
            return Answer(content, self._reported(made))
        made = self.made()
        content = self._written(made)
        if accuracy is not None:
            check_content(content, accuracy)
        return Answer(content, self._reported(made))

    def made(self) -> Mesh | Scene:
        """The mesh, or the scene where the format has nodes."""
        accuracy = self.options.accuracy
        if accuracy is not None:
            return self._certifier(Effort(self.limits.max_multiplications))(accuracy)
        made: Mesh | Scene
        if isinstance(self.model, GroupModel) and self.fmt.encode_scene is not None:
            made = build_scene(self.model, self.options, single=self.fmt.single)
        else:
            made = mesh(self.model, self.options, self.fmt)
        return gridded(made, self.model, self.options) if self.encode.quantize else made

    def _certifier(self, effort: Effort) -> Make:
        """What makes the mesh by tolerance, the stated one or another."""
        if isinstance(self.model, SweepModel):
            raise InvalidRequest(NOT_PATCHES)  # refused when it was planned
        certifier = Certifier(
            self.model,
            self.options,
            self.fmt,
            self.limits,
            effort,
            quantized=self.encode.quantize,
            affordable=self.affordable,
        )

        def make(accuracy: Accuracy, tolerance: float | None = None) -> Mesh | Scene:
            made = certifier.made(accuracy, tolerance)
            check_made(made, self.stored, accuracy, self.limits, (self.fmt, self.encode))
            return made

        return make

    def _written(self, made: Mesh | Scene) -> bytes:
        checkpoint()
        return self.fmt.write(made, self.encode)

    def _reported(self, made: Mesh | Scene) -> MeshReport:
        """The report on the file: its bound is that of the vertices as they are written."""
        report = made.report
        if report.deviation_bound is None or isinstance(made, Scene) or not self.fmt.coarseness:
            return report
        moved = self.fmt.coarseness(made, self.encode)
        if not moved:
            return report
        return replace(report, deviation_bound=largest(np.array([report.deviation_bound + moved])))


def plan(
    surface: Lowerable,
    options: MeshOptions,
    fmt: Format,
    encode: EncodeOptions = PLAIN,
    limits: Limits = DEFAULT_LIMITS,
) -> Work:
    """What is to be computed, after it was found possible and affordable.

    Raises
    ------
    TooLarge, UnsupportedByFormat
        From the shapes alone: nothing large has been allocated. How large a mesh by tolerance
        becomes is known only when it is made; `Work.run` refuses it as soon as it is too large.
    """
    check_lowering(surface, limits)
    return plan_model(surface.lower(), options, fmt, encode, limits)


def plan_model(
    model: Model,
    options: MeshOptions,
    fmt: Format,
    encode: EncodeOptions = PLAIN,
    limits: Limits = DEFAULT_LIMITS,
    *,
    known: Known | None = None,
    expected: Foreseen | None = None,
) -> Work:
    """The same of a surface that is lowered already; raises what `plan` raises.

    Several plans with the same options may share what is `known` of their sizes, and what is
    `expected` of a mesh by tolerance.
    """
    model, options = carried(model, options, fmt)
    if encode.exact and fmt.encode_exact is not None:
        patches_of(model)  # refuses what is none
    size = predict(model, options, known=known)
    stored = predict(model, options, shared=True, known=known) if shares(fmt, encode) else size
    check_accuracy(model, options, fmt, encode)
    check_wires(model, options)
    check_curvatures(model, options)
    check_format(options, fmt, encode)
    if options.accuracy is None:
        check_vertices(size, limits)
        check_sweeps(model, options, limits)
        check_method(model, options, fmt, limits)
        check_bytes(stored, fmt, encode, limits)
    form, held = (fmt, encode), model_bytes(model)
    if options.accuracy is not None:
        room = limits.max_memory // SHARE - held
        affordable = most_certified(model, options, form, stored, room)
        limits.check_memory(
            held + certifying(model, options, form, stored, 0),
            "The mesh",
            stated(options.accuracy),
            "a smaller surface",
        )
        known_most = expected or foreseen(model, options, size, limits, encode)
        most = min(known_most.copies.triangles, affordable)
        memory = held + certifying(model, options, form, stored, max(most, 0))
        return Work(model, options, fmt, encode, size, stored, limits, memory, affordable)
    memory = held + meshing(model, options, form, stored)
    limits.check_memory(
        memory, "The mesh", "/resolution", "a lower resolution, or another format, takes less"
    )
    return Work(model, options, fmt, encode, size, stored, limits, memory)


def render(
    surface: Lowerable,
    options: MeshOptions,
    fmt: Format,
    encode: EncodeOptions = PLAIN,
    limits: Limits = DEFAULT_LIMITS,
) -> bytes:
    """The surface as a file of this format; raises what `plan` raises."""
    return plan(surface, options, fmt, encode, limits).run()


def mesh(model: Model, options: MeshOptions, fmt: Format) -> Mesh:
    """The mesh of a model as the format stores it."""
    made = build(model, options, single=fmt.single)
    return made if fmt.local else about_zero(made)


def shares(fmt: Format, encode: EncodeOptions) -> bool:
    """Whether equal surfaces of a group are stored once."""
    return fmt.encode_scene is not None and not encode.exact


def carried(model: Model, options: MeshOptions, fmt: Format) -> tuple[Model, MeshOptions]:
    """The model and the options without what the format has no place for beside positions.

    A surface keeps its colours and attributes whatever becomes of it, so they are left out and not
    refused; and nothing is computed, or kept apart, for their sake.
    """
    uvs = options.uvs and "uvs" in fmt.carries
    curvatures = options.curvatures and "attribute" in fmt.carries
    model = carrying(model, fmt.carries, apart=fmt.encode_scene is not None)
    if options.curvatures:
        # Whatever the format holds: one request has one mesh in all of them.
        model = with_stretches(model)
    return model, replace(options, uvs=uvs, curvatures=curvatures)
