// Whether meshes may be compressed: the service has the library for it, and this page the decoder.

/** The decoder; null if the service compresses no meshes, or if the decoder cannot be loaded. */
export const decoder = document.documentElement.dataset.compression === 'meshopt' ? load() : Promise.resolve(null);

async function load() {
  try {
    const { MeshoptDecoder } = await import('./meshopt.js');
    await MeshoptDecoder.ready;
    return MeshoptDecoder;
  } catch {
    // A policy of the browser forbids WebAssembly, or the service was replaced by another version meanwhile.
    return null;
  }
}

/** The option that makes the file of a mesh smaller and changes no number. @returns {Promise<{compression?: string}>} */
export async function compression() {
  return await decoder ? { compression: 'meshopt' } : {};
}
