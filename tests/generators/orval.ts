// Two clients of orval, as orval.config.js makes them.

import { createMesh as createGlb } from './glb';
import { createMesh, getSurfaceMesh, projectPoints, type SurfaceDefinition } from './json';
import { KEY, report, type Report } from './report';

const OPTIONS = { headers: { Authorization: `Bearer ${KEY}` } };

const bowl: SurfaceDefinition = {
  control_net: [
    [[0, 0, 1], [0, 0.5, 0], [0, 1, 1]],
    [[0.5, 0, 0], [0.5, 0.5, -1], [0.5, 1, 0]],
    [[1, 0, 1], [1, 0.5, 0], [1, 1, 1]],
  ],
};

const results: Report = { kind: 'orval' };

const mesh = await createMesh({ surface: bowl, resolution: [2, 3] }, {}, OPTIONS);
if (mesh.status === 200) {
  results.vertices = mesh.data.vertices.length;
  results.triangles = mesh.data.report.triangles;
}

const glb = await createGlb({ surface: bowl, resolution: 4 }, { format: 'glb' }, OPTIONS);
if (glb.data instanceof Blob) results.glb = await glb.data.arrayBuffer();

const byUrl = await getSurfaceMesh(
  'saddle', 'json', { resolution: [2, 3], overlays: ['control_net', 'boundary'] }, OPTIONS,
);
if (byUrl.status === 200) results.byUrl = byUrl.data.report.triangles;

const projection = await projectPoints({ surface: bowl, points: [[0.5, 0.5, 1]] }, {}, OPTIONS);
if (projection.status === 200) results.distance = projection.data.distances[0];

const refusal = await createMesh({ surface: bowl, resolution: 0 }, {}, OPTIONS);
if (refusal.status === 422) {
  results.status = refusal.status;
  results.code = refusal.data.errors[0]?.code;
  results.pointer = refusal.data.errors[0]?.pointer;
}

await report(results);
