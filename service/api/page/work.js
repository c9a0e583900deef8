// All that the page waits for passes `perform`: requests, jobs, files that are sent and read. A bar shows
// this work (busy.js), and a button stops it. Work that is stopped or outdated aborts its request; the
// service cancels what no client waits for.

import { NoResponse } from 'surface-service';
import { confirmAnswer, waitForService } from './presence.js';

/** A user stopped the work, on this page or elsewhere. */
export class Stopped extends Error {}

/** The page does not need the result any more, as the surface has changed. */
export class Outdated extends Error {}

/**
 * Work of the page.
 * @typedef {object} Work
 * @property {string} what  such as "Measuring Utah teapot"
 * @property {string} detail  how far it is; empty if that is not known
 * @property {number} start  on the clock `performance.now`
 * @property {() => void} stop
 */

/** The most times that work begins again after the service was away: the work itself may be the reason. */
const MAX_RETRIES = 3;

/** The running work of the page, oldest first. @type {Set<Work>} */
export const works = new Set();

/** @type {(() => void)[]} */
const listeners = [];

/** Calls `listener` after each change of `works`. @param {() => void} listener */
export function watchWorks(listener) {
  listeners.push(listener);
}

/**
 * The result of some work, which is one of `works` until it ends. If the service does not answer, waits
 * until it does, and runs the work again.
 * @template Result
 * @param {string} what  in words, for the bar
 * @param {(signal: AbortSignal, tell: (detail: string) => void) => Promise<Result>} run  stops when its
 *   signal is aborted; `tell` says how far it is
 * @param {AbortSignal} [outdated]  aborted when the page does not need the result any more
 * @returns {Promise<Result>}
 * @throws {Stopped | Outdated | Error}  `Error`: those of `run`
 */
export async function perform(what, run, outdated) {
  const stopper = new AbortController();
  const signal = outdated ? AbortSignal.any([stopper.signal, outdated]) : stopper.signal;
  /** @type {Work} */
  const work = { what, detail: '', start: performance.now(), stop: () => stopper.abort() };
  const tell = (/** @type {string} */ detail) => { work.detail = detail; notify(); };
  works.add(work);
  notify();
  try {
    for (let retries = 0; ; retries += 1) {
      try {
        const result = await run(signal, tell);
        confirmAnswer();
        signal.throwIfAborted();
        return result;
      } catch (error) {
        if (signal.aborted || !(error instanceof NoResponse) || retries === MAX_RETRIES) throw error;
        tell('waits for the service');
        await waitForService(signal);
        tell('');
      }
    }
  } catch (error) {
    if (outdated?.aborted) throw new Outdated(what);
    if (stopper.signal.aborted) throw new Stopped(what);
    throw error;
  } finally {
    works.delete(work);
    notify();
  }
}

function notify() {
  listeners.forEach((listener) => listener());
}
