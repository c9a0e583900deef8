// Two clients of the service at the URL in SERVICE: one for JSON, one for meshes as GLB. Where a call has
// binary responses, orval's client returns every response as a Blob, so a client with all media types
// would return JSON as a Blob, too.

const SERVICE = process.env.SERVICE;

const generate = (target, ...mediaTypes) => ({
  input: `${SERVICE}/openapi.json`,
  output: {
    target,
    client: 'fetch',
    baseUrl: SERVICE,
    override: {
      contentType: { include: ['application/json', 'application/problem+json', ...mediaTypes] },
    },
  },
});

export default { json: generate('json.ts'), glb: generate('glb.ts', 'model/gltf-binary') };
