// Two clients of the service at the URL in SERVICE: one for JSON, one for meshes as GLB. Where a call has
// binary responses, orval's client returns every response as a Blob, so a client with all media types
// would return JSON as a Blob, too. The client for GLB has the calls for meshes alone: a call whose body is
// JSON or a GLB file, such as a check, becomes code that does not compile.

const SERVICE = process.env.SERVICE;

const generate = (target, tags, ...mediaTypes) => ({
  input: { target: `${SERVICE}/openapi.json`, ...(tags && { filters: { tags } }) },
  output: {
    target,
    client: 'fetch',
    baseUrl: SERVICE,
    override: {
      contentType: { include: ['application/json', 'application/problem+json', ...mediaTypes] },
    },
  },
});

export default {
  json: generate('json.ts'),
  glb: generate('glb.ts', ['meshes'], 'model/gltf-binary'),
};
