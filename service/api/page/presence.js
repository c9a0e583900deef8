// Notices when a service that did not answer is back: asks /health, in growing pauses, and at once when
// the browser is online again, when the user returns to the page, or when the user asks for it.

import { client } from './service.js';

/** Milliseconds before each question; the last pause stays. */
const PAUSES = [500, 1000, 2000, 4000, 8000, 15_000, 30_000];

/** Milliseconds after which a question without an answer has failed. */
const PATIENCE = 5000;

/** The number of pauses since the last answer to any work. */
let pauseCount = 0;
/** Ends when the service answers; null if it is not away. @type {Promise<void> | null} */
let watch = null;
/** Ends the running pause. */
let wake = () => {};

/** @type {(isAway: boolean) => void} */
let onChange = () => {};

/** Calls `listener` when the service is away, and when it is back. @param {(isAway: boolean) => void} listener */
export function watchPresence(listener) {
  onChange = listener;
  addEventListener('online', askNow);
  addEventListener('focus', askNow);
  document.addEventListener('visibilitychange', () => { if (!document.hidden) askNow(); });
}

/** Whether the service was asked in vain, and has not answered since. */
export const isServiceAway = () => watch !== null;

/** Asks now whether the service is back, if it is away. */
export function askNow() {
  wake();
}

/** The service has done some work: the next pauses are short again. */
export function confirmAnswer() {
  pauseCount = 0;
}

/** Waits until the service answers, or until the signal is aborted. @param {AbortSignal} signal */
export async function waitForService(signal) {
  watch ??= askUntilAnswer();
  await Promise.race([watch, whenAborted(signal)]);
}

async function askUntilAnswer() {
  await null; // `watch` is set
  onChange(true);
  do {
    await pause();
  } while (!await answers());
  watch = null;
  onChange(false);
}

function pause() {
  const milliseconds = PAUSES[Math.min(pauseCount, PAUSES.length - 1)];
  pauseCount += 1;
  return new Promise((/** @type {(value?: undefined) => void} */ resolve) => {
    const timer = setTimeout(resolve, milliseconds);
    wake = () => { clearTimeout(timer); resolve(); };
  });
}

/** Whether the service answers now. */
export async function answers() {
  try {
    const signal = AbortSignal.timeout(PATIENCE);
    return (await fetch(client.resolve('health'), { cache: 'no-store', signal })).ok;
  } catch {
    return false;
  }
}

/** @param {AbortSignal} signal @returns {Promise<void>} */
function whenAborted(signal) {
  return new Promise((resolve) => {
    if (signal.aborted) resolve();
    else signal.addEventListener('abort', () => resolve(), { once: true });
  });
}
