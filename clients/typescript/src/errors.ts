// The errors of calls. A call that is aborted throws the reason of its signal, as `fetch` does.

import type { Issue, Problem } from './types.js';

/** The service refused a request, or failed: a problem document (RFC 9457) as an error. */
export class ServiceError extends Error {
  override readonly name = 'ServiceError';
  /** The HTTP status. */
  readonly status: number;
  /** The code, for programs; empty if something else than the service responded, such as a proxy. */
  readonly code: Problem['code'] | '';
  readonly title: string;
  /** The mistakes in the request, each with its code and its place. */
  readonly errors: readonly Issue[];
  /** Seconds after which the service may accept the request. */
  readonly retryAfter: number | undefined;

  constructor(problem: Partial<Problem>, retryAfter?: number) {
    super(problem.detail ?? problem.title ?? 'The service refused the request.');
    this.status = problem.status ?? 0;
    this.code = problem.code ?? '';
    this.title = problem.title ?? 'Refused';
    this.errors = problem.errors ?? [];
    this.retryAfter = retryAfter;
  }
}

/** The service did not respond: it is away, took longer than the timeout, or the origin is not allowed. */
export class NoResponse extends Error {
  override readonly name = 'NoResponse';
}

/** The error that a response without success reports. */
export async function readError(response: Response): Promise<ServiceError | NoResponse> {
  const { status, statusText, headers } = response;
  const retryAfter = readSeconds(headers.get('Retry-After'));
  if (isMediaType(response, 'application/problem+json')) {
    return new ServiceError(await response.json() as Problem, retryAfter);
  }
  // A proxy responds in place of a service that is away.
  if (status >= 502 && retryAfter === undefined) {
    return new NoResponse(`The service does not answer: ${status} ${statusText}`);
  }
  return new ServiceError({ title: statusText || 'Refused', status }, retryAfter);
}

/** Whether a response has this media type. */
export function isMediaType(response: Response, mediaType: string): boolean {
  return (response.headers.get('Content-Type') ?? '').split(';')[0]?.trim() === mediaType;
}

/** Whether the service needs more time for the work than a request has. */
export function takesLong(error: unknown): boolean {
  return error instanceof ServiceError
    && (error.code === 'out_of_time' || error.errors.some(({ code }) => code === 'too_costly'));
}

/** The seconds in a Retry-After header, which has a number or a date. */
function readSeconds(header: string | null): number | undefined {
  if (header === null) return undefined;
  const seconds = /^\d+$/.test(header) ? Number(header) : (Date.parse(header) - Date.now()) / 1000;
  return Number.isNaN(seconds) ? undefined : Math.max(seconds, 0);
}
