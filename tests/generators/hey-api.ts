// A client of hey-api.

import { createMesh, getSurfaceMesh, projectPoints, type SurfaceDefinition } from './generated';
import { client } from './generated/client.gen';
import { KEY, report, SERVICE, type Report } from './report';

client.setConfig({ baseUrl: SERVICE, auth: KEY });

const bowl: SurfaceDefinition = {
  control_net: [
    [[0, 0, 1], [0, 0.5, 0], [0, 1, 1]],
    [[0.5, 0, 0], [0.5, 0.5, -1], [0.5, 1, 0]],
    [[1, 0, 1], [1, 0.5, 0], [1, 1, 1]],
  ],
};

const results: Report = { kind: 'hey-api' };

const mesh = await createMesh({ body: { surface: bowl, resolution: [2, 3] } });
results.vertices = mesh.data?.vertices.length;
results.triangles = mesh.data?.report.triangles;

// Without `stream`, it would parse every type but application/… and image/… as JSON.
const glb = await createMesh({
  body: { surface: bowl, resolution: 4 }, query: { format: 'glb' }, parseAs: 'stream',
});
results.glb = await glb.response?.arrayBuffer();

const byUrl = await getSurfaceMesh({
  path: { id: 'saddle', suffix: 'json' },
  query: { resolution: [2, 3], overlays: ['control_net', 'boundary'] },
});
results.byUrl = byUrl.data?.report.triangles;

const projection = await projectPoints({ body: { surface: bowl, points: [[0.5, 0.5, 1]] } });
results.distance = projection.data?.distances[0];

const refusal = await createMesh({ body: { surface: bowl, resolution: 0 } });
results.status = refusal.response?.status;
results.code = refusal.error?.errors[0]?.code;
results.pointer = refusal.error?.errors[0]?.pointer;

await report(results);
