// Right and wrong uses of the types in openapi/surface-service.d.ts: the compiler takes the right
// ones and refuses the wrong ones, each of which stands below a @ts-expect-error. Never run.

import createClient from 'openapi-fetch';
import type {
  BsplineDefinition, CurveDefinition, Format, Issue, Mesh, MeshReport, MeshRequest, operations, paths,
  Points, Problem, StoredSurface, SurfaceDefinition,
} from '../../openapi/surface-service';

type MeshQuery = NonNullable<operations['getSurfaceMesh']['parameters']['query']>;
type Headers = operations['getSurfaceMesh']['responses'][200]['headers'];

type Equal<A, B> = [A] extends [B] ? ([B] extends [A] ? true : false) : false;

/** Compiles only where `A` and `B` are one type. */
function same<A, B>(_: Equal<A, B>): void {}

// Requests: what a server fills in may be left out.
const net: [number, number, number][][] = [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]];
const patch: SurfaceDefinition = { control_net: net };
const spline: BsplineDefinition = {
  type: 'bspline', control_net: net, degree: [1, 1], knots: ['clamped', [0, 0, 1, 1]],
};
const tube: SurfaceDefinition = {
  type: 'tube', curve: { control_points: [[0, 0], [1, 0, 1]] }, radius: 0.1,
};
const group: SurfaceDefinition = {
  type: 'group', members: [{ surface: patch, name: 'sail', color: [1, 0, 0] }, { surface: tube }],
};
export const requests: MeshRequest[] = [
  { surface: patch },
  { surface: spline, resolution: 4 },
  { surface: group, resolution: [4, 8], faces: 'quads', overlays: ['boundary'] },
  { surface: patch, tolerance: 0.01, two_sided: true },
  {
    surface: patch,
    camera: { position: [4, 3, 9], field_of_view: 0.8, height: 1080 },
    pixel_tolerance: 0.5,
  },
];

// @ts-expect-error a surface without a net
export const empty: SurfaceDefinition = { type: 'bezier' };
// @ts-expect-error a point of two numbers
export const flat: SurfaceDefinition = { control_net: [[[0, 0], [0, 1]], [[1, 0], [1, 1]]] };
// @ts-expect-error a number as a text
export const text: SurfaceDefinition = { control_net: [[['0', 0, 0]]] };
// @ts-expect-error a kind that there is not
export const kind: SurfaceDefinition = { type: 'nurbs', control_net: net };
// @ts-expect-error the field of another kind
export const mixed: SurfaceDefinition = { type: 'tube', control_net: net };
// @ts-expect-error a group in a group
export const nested: SurfaceDefinition = { type: 'group', members: [{ surface: group }] };
// @ts-expect-error a misspelt option
export const misspelt: MeshRequest = { surface: patch, resolutions: 4 };
// @ts-expect-error a value that the option has not
export const unknown: MeshRequest = { surface: patch, faces: 'hexagons' };
// @ts-expect-error three numbers of divisions
export const three: MeshRequest = { surface: patch, resolution: [1, 2, 3] };
// @ts-expect-error null, which is refused everywhere
export const none: MeshRequest = { surface: patch, tolerance: null };
// @ts-expect-error no surface
export const options: MeshRequest = { resolution: 4 };
// @ts-expect-error a curve is no surface
export const curve: CurveDefinition = { control_net: net };

// `type` tells the kinds apart.
export function pointsOf(surface: SurfaceDefinition): number {
  switch (surface.type) {
    case 'group': return surface.members.length;
    case 'patches': return surface.vertices.length;
    case 'multipatch': return surface.surfaces.length;
    case 'tube': case 'ribbon': return surface.curve.control_points.length;
    default: return surface.control_net.flat().length;
  }
}

// Answers: what is always there is not optional, what may be missing is.
declare const mesh: Mesh;
declare const points: Points;
declare const problem: Problem;
declare const format: Format;
same<Mesh['vertices'][number], [number, number, number]>(true);
same<Mesh['report'], MeshReport>(true);
same<Headers['ETag'], string>(true);
same<StoredSurface['links']['mesh']['glb'], string>(true);
same<Format['compression'], 'meshopt'[]>(true);
same<Problem['errors'][number], Issue>(true);
export const height: number = mesh.report.bounds.max[1] + mesh.vertices.length;
export const second: number | null | undefined = points.mean_curvature?.[0];
export const quads: boolean = format.quads;
// @ts-expect-error meshes may come without normals
export const normals: number[][] = mesh.normals;
// @ts-expect-error a bound is there only where something is proved
export const bound: number = mesh.report.deviation_bound;
// @ts-expect-error there is no such kind of problem
export const teapot: boolean = problem.code === 'im_a_teapot';

// Calls by openapi-fetch: paths, queries and bodies. (It makes lists of tuples in answers.)
const service = createClient<paths, 'application/json' | 'application/problem+json'>();
export async function calls(): Promise<string | undefined> {
  const { data, error } = await service.POST('/v1/mesh', { body: { surface: patch } });
  const vertices: number[][] | undefined = data?.vertices;
  const issues: Issue[] | undefined = error?.errors;
  // @ts-expect-error an answer has no such field
  const positions: number[][] | undefined = data?.positions;
  // @ts-expect-error a path that there is not
  await service.GET('/v2/mesh');
  // @ts-expect-error a method that the path has not
  await service.PUT('/v1/mesh', { body: { surface: patch } });
  // @ts-expect-error a body without a surface
  await service.POST('/v1/mesh', { body: {} });
  const stored = await service.POST('/v1/surfaces', { body: { surface: patch } });
  const link: string | undefined = stored.data?.links.mesh.glb;
  const path = { id: stored.data?.id ?? 'saddle', suffix: 'glb' } as const;
  const address = '/v1/surfaces/{id}/mesh.{suffix}';
  const query = { resolution: [4, 8], engine: 3 } satisfies MeshQuery;
  const { data: file } = await service.GET(address, { params: { path, query }, parseAs: 'blob' });
  same<typeof file, Blob | undefined>(true);
  // @ts-expect-error no file has this suffix
  await service.GET(address, { params: { path: { ...path, suffix: 'fbx' } } });
  // @ts-expect-error an address without its id
  await service.GET(address, { params: { path: { suffix: 'glb' } } });
  // @ts-expect-error a camera stands in bodies only
  const seen: MeshQuery = { camera: { position: [0, 0, 1], field_of_view: 1, height: 1 } };
  if (link || file || seen) return link;
  return vertices && positions ? undefined : issues?.[0]?.pointer;
}
