// The client of Surface Service, for browsers and for Node.

export { SurfaceClient } from './client.js';
export type { CallOptions, ClientOptions, Progress } from './connection.js';
export { NoResponse, ServiceError } from './errors.js';
export { toBufferGeometry, type ThreeModule } from './geometry.js';
export { RunningJob } from './jobs.js';
export { NewestOnly, type Busy, type NewestOnlyOptions } from './newest.js';
export type * from './types.js';
