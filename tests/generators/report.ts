// What the clients have in common: the service, and the report that the test reads.

// `esbuild --define` replaces both names.
declare const SERVICE_URL: string, SERVICE_KEY: string;

export const SERVICE = SERVICE_URL, KEY = SERVICE_KEY;

/** What a client has received; what it has not is left out. */
export interface Report {
  kind: string;
  vertices?: number | undefined;
  triangles?: number | undefined;
  byUrl?: number | undefined;
  distance?: number | undefined;
  glb?: ArrayBuffer | undefined;
  status?: number | undefined;
  code?: string | undefined;
  pointer?: string | undefined;
}

/** Prints a report as JSON, with the first bytes and the length of the GLB. */
export async function report({ glb, ...results }: Report): Promise<void> {
  const magic = glb && new TextDecoder().decode(glb.slice(0, 4));
  console.log(JSON.stringify({ ...results, magic, bytes: glb?.byteLength }));
}
