// Valid and invalid uses of the TypeScript client. Each invalid use follows a comment @ts-expect-error:
// the compiler must refuse it. The program is compiled and never run.

import * as THREE from 'three';
import {
  NewestOnly, NoResponse, ServiceError, SurfaceClient, toBufferGeometry,
  type Mesh, type SurfaceDefinition,
} from 'surface-service';

const client = new SurfaceClient('http://127.0.0.1:8000', { key: () => 'key', timeout: 1000 });
const net: SurfaceDefinition = { control_net: [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]] };
export async function use(signal: AbortSignal): Promise<void> {
  const mesh: Mesh = await client.mesh(net, { resolution: [2, 4], faces: 'quads' }, { signal });
  const file: ArrayBuffer = await client.mesh('sphere', { format: 'glb', engine: 4 });
  const picture: ArrayBuffer = await client.image('sphere', { edges: true, position: [4, 3, 9], target: [0, 0, 0] });
  const geometry: THREE.BufferGeometry = toBufferGeometry(THREE, mesh);
  const sections: ArrayBuffer = await client.intersect(
    net, { planes: { normals: [[0, 0, 1]], offsets: [0] }, format: 'obj' });
  const { distances } = await client.project({ curve: { control_points: [[0, 0], [1, 1]] } }, { points: [[1, 0]] });
  const { surface } = await client.convert({ file: new Blob([]), up: 'z' });
  const numbers: readonly number[] = distances;
  const check = await client.check('sphere', mesh, { relative_tolerance: 0.02, quad_diagonal: '13' });
  const checked: number = (await client.check(net, { file: new Blob([]), format: 'stl' })).surface_to_mesh.high;
  const queue = new NewestOnly((item: number, end: AbortSignal) => client.mesh(net, { resolution: item }, { signal: end }));
  const newest: Mesh | undefined = await queue.run(3);
  // @ts-expect-error no option has this name
  await client.mesh(net, { resolutions: 4 });
  // @ts-expect-error the option does not have this value
  await client.mesh(net, { faces: 'hexagons' });
  // @ts-expect-error no format has this name
  await client.mesh(net, { format: 'fbx' });
  // @ts-expect-error the option does not have this value
  await client.image(net, { look: 'matt' });
  // @ts-expect-error a file is not a mesh in numbers
  const wrong: Mesh = await client.mesh(net, { format: 'glb' });
  // @ts-expect-error points are needed
  await client.project(net, {});
  // @ts-expect-error no field has this name
  await client.mesh({ control_nets: [] });
  // @ts-expect-error no measure has this name
  (await client.measure(net)).areas;
  // @ts-expect-error no format of meshes has this name
  await client.check(net, { file: new Blob([]), format: 'step' });
  // @ts-expect-error a mesh is needed
  await client.check(net);
  // @ts-expect-error the queue takes numbers
  await queue.run('3');
  try {
    await client.points(surface, { uv: [[0, 0]] });
  } catch (error) {
    if (error instanceof ServiceError) console.log(error.errors[0]?.pointer, error.retryAfter?.toFixed());
    if (error instanceof NoResponse) console.log(error.cause);
  }
  console.log(file, geometry, sections, numbers, newest, wrong, check.open_edges, checked);
}
