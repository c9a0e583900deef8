// The types of requests and responses, which are generated from the OpenAPI document (`make types`).

import type {
  CheckRequest, CurveDefinition, CurveRequest, ConvertRequest, IntersectRequest, MeasureRequest,
  MeshDefinition, MeshFile, MeshRequest, operations, PictureRequest, PointsRequest, ProjectRequest,
  SignRequest, SurfaceDefinition,
} from '../../../openapi/surface-service.js';

export type * from '../../../openapi/surface-service.js';

type Query<Name extends keyof operations> = NonNullable<operations[Name]['parameters']['query']>;

/** What calls add to a request by themselves. */
type Filled = 'surface' | 'curve' | 'reading' | 'orientation';

/** How a file is read; a CAD file needs none of these. */
export type FileOptions = Pick<
  Query<'createMesh'>, 'type' | 'degree' | 'knots' | 'homogeneous' | 'up' | 'name' | 'invalid_faces'
>;

/** A file of a surface, such as STEP or NumPy, and how it is read. */
export interface SurfaceFile extends FileOptions {
  /** The content; a `File` with a known suffix needs no `mediaType`. */
  file: Blob;
  mediaType?: string | undefined;
}

/** A surface: its definition, the id of a stored surface or of an example, or a file. */
export type SurfaceInput = SurfaceDefinition | string | SurfaceFile;

/** A file with a mesh. */
export interface MeshBlob {
  /** The content; a `File` with the suffix of its format needs no `format`. */
  file: Blob;
  format?: MeshFile['format'] | undefined;
}

/** A mesh that is compared with a surface: vertices and faces, such as a `Mesh`, or a file. */
export type MeshInput = MeshDefinition | MeshFile | MeshBlob;

/** A curve, where a call also takes surfaces. */
export interface CurveInput {
  curve: CurveDefinition;
}

/** Formats of meshes; `json` is read as a `Mesh`, and the others are files. */
export type MeshFormat = NonNullable<Query<'createMesh'>['format']>;
/** Formats of curves and of sections. */
export type CurveFormat = NonNullable<Query<'createCurve'>['format']>;
/** Formats of converted surfaces. */
export type SurfaceFormat = NonNullable<Query<'convertSurface'>['format']>;

/** The options of a mesh. `engine` is for meshes of ids: the version of the engine. */
export interface MeshOptions extends Omit<MeshRequest, Filled> {
  engine?: number;
}
/** The options of a picture; `engine` as for meshes. */
export interface PictureOptions extends Omit<PictureRequest, Filled> {
  engine?: number;
}
export type PointsOptions = Omit<PointsRequest, Filled>;
export type CurveOptions = Omit<CurveRequest, Filled>;
export type ProjectOptions = Omit<ProjectRequest, Filled>;
export type IntersectOptions = Omit<IntersectRequest, Filled>;
export type MeasureOptions = Omit<MeasureRequest, Filled>;
export type CheckOptions = Omit<CheckRequest, Filled | 'mesh'>;
export type ConvertOptions = Omit<ConvertRequest, Filled>;
export type SignOptions = Omit<SignRequest, 'url'>;
