// The path of a mesh that another page names for `/embed`: only meshes of this service are loaded.

/** The paths of meshes, below the path of the service. */
const MESH = /^v1\/surfaces\/[A-Za-z0-9._~-]+\/mesh\.glb$/;

/**
 * The URL of the mesh with a path, signed or not; null if the text is not the path of a mesh of this service.
 * @param {string} src  such as `/v1/surfaces/saddle/mesh.glb?resolution=8` @param {string} page  the URL of this page
 * @returns {string | null}
 */
export function resolveMesh(src, page) {
  // Two slashes, or a slash and a backslash, begin the name of a host.
  if (!/^\/[^/\\]/.test(src) || !URL.canParse(src, page)) return null;
  const url = new URL(src, page);
  const base = new URL('.', page);
  if (url.origin !== base.origin || !url.pathname.startsWith(base.pathname)) return null;
  return MESH.test(url.pathname.slice(base.pathname.length)) ? `${url.origin}${url.pathname}${url.search}` : null;
}
