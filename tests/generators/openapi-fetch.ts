// A client of openapi-fetch, with the types of openapi-typescript.

import createClient from 'openapi-fetch';
import { KEY, report, SERVICE, type Report } from './report';
import type { paths, SurfaceDefinition } from './generated';

const service = createClient<paths, 'application/json' | 'application/problem+json'>({
  baseUrl: SERVICE, headers: { Authorization: `Bearer ${KEY}` },
});

const bowl: SurfaceDefinition = {
  control_net: [
    [[0, 0, 1], [0, 0.5, 0], [0, 1, 1]],
    [[0.5, 0, 0], [0.5, 0.5, -1], [0.5, 1, 0]],
    [[1, 0, 1], [1, 0.5, 0], [1, 1, 1]],
  ],
};

const results: Report = { kind: 'openapi-fetch' };

const mesh = await service.POST('/v1/mesh', { body: { surface: bowl, resolution: [2, 3] } });
results.vertices = mesh.data?.vertices.length;
results.triangles = mesh.data?.report.triangles;

const glb = await service.POST('/v1/mesh', {
  body: { surface: bowl, resolution: 4 }, params: { query: { format: 'glb' } }, parseAs: 'arrayBuffer',
});
results.glb = glb.data;

const byUrl = await service.GET('/v1/surfaces/{id}/mesh.{suffix}', {
  params: {
    path: { id: 'saddle', suffix: 'json' },
    query: { resolution: [2, 3], overlays: ['control_net', 'boundary'] },
  },
});
results.byUrl = byUrl.data?.report.triangles;

const projection = await service.POST('/v1/project', {
  body: { surface: bowl, points: [[0.5, 0.5, 1]] },
});
results.distance = projection.data?.distances[0];

const refusal = await service.POST('/v1/mesh', { body: { surface: bowl, resolution: 0 } });
results.status = refusal.response.status;
results.code = refusal.error?.errors[0]?.code;
results.pointer = refusal.error?.errors[0]?.pointer;

await report(results);
