// The calls of the service.

import {
  encodeMesh, type Fields, fileFields, isMeshBlob, postFile, postJson, postMesh, withQuery,
} from './body.js';
import { type CallOptions, type ClientOptions, Connection, OutOfPatience } from './connection.js';
import { isMediaType, NoResponse, ServiceError, takesLong } from './errors.js';
import { awaitResult, RunningJob } from './jobs.js';
import type {
  CheckOptions, ClosestPoints, ConvertOptions, Curve, CurveDefinition, CurveFormat, CurveInput, CurveOptions,
  Estimate, FormatList, IntersectOptions, Job, JobRequest, MeasureOptions, Mesh, MeshCheck, MeshFormat,
  MeshInput, MeshOptions, PictureOptions, PlaneSet, Points, PointsOptions, ProjectOptions, RayHits, Rays, Sections,
  SignedAddress, SignOptions, StoredSurface, SurfaceDefinition, SurfaceDocument, SurfaceFile,
  SurfaceFormat, SurfaceInput, SurfaceList, SurfaceMeasures,
} from './types.js';

type Read = (response: Response) => Promise<unknown>;

/**
 * A client of the service at an address. In a page, the address may be relative to the page; by default
 * it is the folder of the page.
 *
 * Every call throws a `ServiceError` if the service refuses it, and `NoResponse` if the service is
 * away. While the service is busy (429, 503), a call waits and tries again until its timeout. Long
 * work becomes a job by itself.
 */
export class SurfaceClient {
  readonly #connection: Connection;

  constructor(base: string | URL = './', options: ClientOptions = {}) {
    this.#connection = new Connection(base, options);
  }

  /** The mesh of a surface: numbers in JSON, or with another format a file. */
  mesh(surface: SurfaceInput, options?: MeshOptions & { format?: 'json' }, call?: CallOptions): Promise<Mesh>;
  mesh(
    surface: SurfaceInput, options: MeshOptions & { format: Exclude<MeshFormat, 'json'> }, call?: CallOptions,
  ): Promise<ArrayBuffer>;
  async mesh(
    surface: SurfaceInput, { format = 'json', ...options }: MeshOptions & { format?: MeshFormat } = {},
    call: CallOptions = {},
  ): Promise<unknown> {
    const read = reader(format);
    // A mesh by its address may be cached. A camera does not fit into an address.
    if (typeof surface === 'string' && options.camera === undefined) {
      const path = `v1/surfaces/${encodeURIComponent(surface)}/mesh.${format}`;
      return this.#fetchFile(withQuery(path, { ...options }), call, read);
    }
    return this.#send('mesh', surface, { ...options }, query(format), call, read);
  }

  /** A picture of a surface: a PNG file. A page can also show its address, `/v1/surfaces/{id}/image.png`. */
  async image(surface: SurfaceInput, options: PictureOptions = {}, call: CallOptions = {}): Promise<ArrayBuffer> {
    const read = reader('png');
    if (typeof surface === 'string') {
      const path = `v1/surfaces/${encodeURIComponent(surface)}/image.png`;
      return await this.#fetchFile(withQuery(path, { ...options }), call, read) as ArrayBuffer;
    }
    return await this.#send('image', surface, { ...options }, {}, call, read) as ArrayBuffer;
  }

  /** Points, normals, derivatives and curvatures at parameters. */
  async points(surface: SurfaceInput, options: PointsOptions, call: CallOptions = {}): Promise<Points> {
    return await this.#ask('points', await this.#define(surface, call), options, call) as Points;
  }

  /** Points of a curve, or its file. */
  curve(curve: CurveDefinition, options?: CurveOptions & { format?: 'json' }, call?: CallOptions): Promise<Curve>;
  curve(
    curve: CurveDefinition, options: CurveOptions & { format: Exclude<CurveFormat, 'json'> }, call?: CallOptions,
  ): Promise<ArrayBuffer>;
  async curve(
    curve: CurveDefinition, { format = 'json', ...options }: CurveOptions & { format?: CurveFormat } = {},
    call: CallOptions = {},
  ): Promise<unknown> {
    return this.#ask('curve', { curve }, options, call, format);
  }

  /** The points of a surface, or of a curve, that are nearest to other points. */
  async project(
    surface: SurfaceInput | CurveInput, options: ProjectOptions, call: CallOptions = {},
  ): Promise<ClosestPoints> {
    const target = isCurve(surface) ? surface : await this.#define(surface, call);
    return await this.#ask('project', target, options, call) as ClosestPoints;
  }

  /** Where rays or planes meet a surface; with another format than JSON, the file of its sections. */
  intersect(
    surface: SurfaceInput, options: IntersectOptions & { rays: Rays; format?: 'json' }, call?: CallOptions,
  ): Promise<RayHits>;
  intersect(
    surface: SurfaceInput, options: IntersectOptions & { planes: PlaneSet; format?: 'json' }, call?: CallOptions,
  ): Promise<Sections>;
  intersect(
    surface: SurfaceInput, options: IntersectOptions & { format: Exclude<CurveFormat, 'json'> }, call?: CallOptions,
  ): Promise<ArrayBuffer>;
  async intersect(
    surface: SurfaceInput, { format = 'json', ...options }: IntersectOptions & { format?: CurveFormat },
    call: CallOptions = {},
  ): Promise<unknown> {
    return this.#ask('intersect', await this.#define(surface, call), options, call, format);
  }

  /** Area, volume, centroid and moments. */
  async measure(
    surface: SurfaceInput, options: MeasureOptions = {}, call: CallOptions = {},
  ): Promise<SurfaceMeasures> {
    return await this.#send('measure', surface, { ...options }, {}, call) as SurfaceMeasures;
  }

  /** How far a mesh of any program and its surface are apart, proved; and the faults of the mesh. */
  async check(
    surface: SurfaceInput, mesh: MeshInput, options: CheckOptions = {}, call: CallOptions = {},
  ): Promise<MeshCheck> {
    if (typeof surface === 'string' && isMeshBlob(mesh)) {
      const path = withQuery('v1/check', { surface, ...options });
      return await this.#compute(path, postMesh(mesh), call, readJson) as MeshCheck;
    }
    const about = { ...await this.#define(surface, call), mesh: isMeshBlob(mesh) ? await encodeMesh(mesh) : mesh };
    return await this.#ask('check', about, options, call) as MeshCheck;
  }

  /** The surface in another form or after operations; a file as a surface; a surface as a CAD file. */
  convert(
    surface: SurfaceInput, options?: ConvertOptions & { format?: 'json' }, call?: CallOptions,
  ): Promise<SurfaceDocument>;
  convert(
    surface: SurfaceInput, options: ConvertOptions & { format: Exclude<SurfaceFormat, 'json'> }, call?: CallOptions,
  ): Promise<ArrayBuffer>;
  async convert(
    surface: SurfaceInput, { format = 'json', ...options }: ConvertOptions & { format?: SurfaceFormat } = {},
    call: CallOptions = {},
  ): Promise<unknown> {
    return this.#send('convert', surface, options, query(format), call, reader(format));
  }

  /** How large a mesh would be, and how long it would take. */
  async estimate(
    surface: SurfaceInput, { format, ...options }: MeshOptions & { format?: MeshFormat } = {}, call: CallOptions = {},
  ): Promise<Estimate> {
    return await this.#send('estimate', surface, { ...options }, query(format), call) as Estimate;
  }

  /** Stores a surface, and returns its id and the addresses of its meshes. */
  async store(surface: SurfaceDefinition | SurfaceFile, call: CallOptions = {}): Promise<StoredSurface> {
    return await this.#send('surfaces', surface, {}, {}, { ...call, patience: Infinity }) as StoredSurface;
  }

  /** A signed address, with which others read without a key until it expires. */
  async sign(url: string, options: SignOptions = {}, call: CallOptions = {}): Promise<SignedAddress> {
    return await this.#read('v1/sign', postJson({ url, ...options }), call) as SignedAddress;
  }

  /** A stored surface, or an example, by its id. */
  async surface(id: string, call: CallOptions = {}): Promise<SurfaceDocument> {
    return await this.#read(`v1/surfaces/${encodeURIComponent(id)}`, {}, call) as SurfaceDocument;
  }

  /** The examples. */
  async surfaces(call: CallOptions = {}): Promise<SurfaceList['surfaces']> {
    return (await this.#read('v1/surfaces', {}, call) as SurfaceList).surfaces;
  }

  /** The formats that the service writes and reads. */
  async formats(call: CallOptions = {}): Promise<FormatList> {
    return await this.#read('v1/formats', {}, call) as FormatList;
  }

  /** Starts a job of these parts; with an id, the job that has it. */
  async job(parts: JobRequest['parts'] | string, call: CallOptions = {}): Promise<RunningJob> {
    const state = typeof parts === 'string'
      ? this.#read(`v1/jobs/${encodeURIComponent(parts)}`, {}, call)
      : this.#read('v1/jobs', postJson({ parts }), call);
    return new RunningJob(this.#connection, await state as Job);
  }

  /** The response to any other request. Its body is not read yet, and no timeout limits the reading. */
  async request(path: string, init: RequestInit = {}, call: CallOptions = {}): Promise<Response> {
    return (await this.#connection.exchange(path, init, call, async () => {})).response;
  }

  /** The absolute URL of a path of the service, such as those in `links`. */
  resolve(path: string): string {
    return this.#connection.resolve(path);
  }

  /** Posts a surface, as a definition or as a file, with the fields of a request. */
  async #send(
    name: string, surface: SurfaceInput, options: Fields, query: Fields, call: CallOptions, read = readJson,
  ): Promise<unknown> {
    if (typeof surface !== 'string' && 'file' in surface) {
      const path = withQuery(`v1/${name}`, { ...query, ...fileFields(surface), ...options });
      return this.#compute(path, postFile(surface), call, read);
    }
    const body = postJson({ ...await this.#define(surface, call), ...options });
    return this.#compute(withQuery(`v1/${name}`, query), body, call, read);
  }

  /** Posts a document with what it is about. */
  async #ask(name: string, about: object, options: object, call: CallOptions, format?: string): Promise<unknown> {
    const path = withQuery(`v1/${name}`, query(format));
    return this.#compute(path, postJson({ ...about, ...options }), call, reader(format));
  }

  /** The surface as a document; the service converts files and knows the surfaces of ids. */
  async #define(surface: SurfaceInput, { signal, timeout }: CallOptions): Promise<{ surface: SurfaceDefinition }> {
    if (typeof surface === 'string') return { surface: (await this.surface(surface, { signal, timeout })).surface };
    if (!('file' in surface)) return { surface };
    return { surface: (await this.convert(surface, {}, { signal, timeout })).surface };
  }

  async #read(path: string, init: RequestInit, call: CallOptions): Promise<unknown> {
    const { response, body } = await this.#connection.exchange(path, init, call, readJson);
    call.onResponse?.(response);
    return body;
  }

  /** The result of a call, as soon as it is there: at once, or by a job if it takes long. */
  async #compute(path: string, init: RequestInit, call: CallOptions, read: Read): Promise<unknown> {
    const patience = call.patience ?? this.#connection.patience;
    try {
      return finish(await this.#connection.exchange(path, init, call, read, patience), call);
    } catch (error) {
      if (!(error instanceof OutOfPatience || takesLong(error))) throw error;
    }
    const headers = { ...init.headers, Prefer: 'respond-async' };
    // A service without jobs ignores the preference.
    const readEither = (response: Response) => (isJob(response) ? response.json() : read(response));
    const answer = await this.#connection.exchange(path, { ...init, headers }, call, readEither);
    return isJob(answer.response) ? this.#fetchResult(answer.body as Job, call, read) : finish(answer, call);
  }

  /** A mesh or a picture by its address; what takes long is the part of a job. */
  async #fetchFile(path: string, call: CallOptions, read: Read): Promise<unknown> {
    const fetchAtOnce = async (patience: number) => (
      finish(await this.#connection.exchange(path, {}, call, read, patience), call));
    let reason: unknown;
    try {
      return await fetchAtOnce(call.patience ?? this.#connection.patience);
    } catch (error) {
      if (!(error instanceof OutOfPatience || takesLong(error))) throw error;
      reason = error;
    }
    const { signal, timeout, onProgress } = call;
    try {
      const { state } = await this.job([{ path: `/${path}` }], { signal, timeout, onProgress });
      return await this.#fetchResult(state, call, read);
    } catch (error) {
      // A service without jobs has time for the file, or has said that it has none.
      const isWithoutJobs = error instanceof ServiceError && error.code === 'not_found';
      if (!isWithoutJobs) throw error;
      if (!(reason instanceof OutOfPatience)) throw reason;
      return fetchAtOnce(Infinity);
    }
  }

  async #fetchResult(job: Job, call: CallOptions, read: Read): Promise<unknown> {
    const path = await awaitResult(this.#connection, job, call);
    return finish(await this.#connection.exchange(path, {}, call, read), call);
  }
}

/** Shows the response to the caller, and returns its body. */
function finish({ response, body }: { response: Response; body: unknown }, call: CallOptions): unknown {
  call.onResponse?.(response);
  return body;
}

/** The query that asks for a format. */
function query(format = 'json'): Fields {
  return format === 'json' ? {} : { format };
}

/** The function that reads a response in this format. */
function reader(format = 'json'): Read {
  return format === 'json' ? readJson : (response) => response.arrayBuffer();
}

async function readJson(response: Response): Promise<unknown> {
  if (isMediaType(response, 'application/json')) return response.json();
  throw new NoResponse(`This is not a surface service: ${response.url}`);
}

function isJob(response: Response): boolean {
  return response.headers.has('Preference-Applied');
}

function isCurve(target: SurfaceInput | CurveInput): target is CurveInput {
  return typeof target === 'object' && 'curve' in target && !('type' in target);
}
