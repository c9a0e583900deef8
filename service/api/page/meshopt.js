// The decoder of compressed meshes, which is loaded only if the service compresses them: it is WebAssembly.

export { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';
