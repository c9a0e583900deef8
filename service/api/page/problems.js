// Shows the errors of the service, or that it does not respond: the cause, the field, and the remedy.

import { NoResponse, ServiceError } from 'surface-service';
import { isAboutKeys } from './key.js';
import { parsePointer } from './documents.js';
import { announce, button, element, makeElement, write } from './page.js';
import { NotOpened } from './opening.js';
import { askNow, watchPresence } from './presence.js';
import { Unreadable } from './unreadable.js';
import { Stopped } from './work.js';

/** @typedef {import('./net.js').Net} Net */
/** @typedef {import('surface-service').Issue} Issue */
/** @typedef {import('./state.js').State} State */

/** The kind of a problem, also in `html[data-state]`. @typedef {'refused' | 'away'} Kind */

/** The error that is shown, or was shown last. @type {Error | null} */
let shown = null;
/** Does again what this error is about. */
let again = () => {};

/** @param {State} state */
export function watchProblems(state) {
  button('problem-close').addEventListener('click', hideProblem);
  let isAway = false;
  button('problem-retry').addEventListener('click', () => (isAway ? askNow() : again()));
  watchPresence((isNowAway) => {
    isAway = isNowAway;
    if (isAway) showAway(state);
    else hideAway();
  });
  button('problem-example').addEventListener('click', () => button('open').click());
  button('problem-undo').addEventListener('click', () => state.undo());
  button('problem-point').addEventListener('click', () => {
    state.choose(Number(button('problem-point').dataset.index));
  });
}

const root = document.documentElement;
/** The state of the page before the service was away. */
let stateBefore = '';

/** Codes of refusals that are not about the content of a surface. */
const HAS_TITLE = new Set(['unknown_surface', 'key_needed', 'key_unknown']);

/** Shows that the service is away, until `hideAway`. @param {State} state */
function showAway(state) {
  stateBefore = root.dataset.state ?? '';
  showProblem(new NoResponse(), state);
  root.dataset.state = 'away';
}

/** The service is back: the page sends again what waits. */
function hideAway() {
  if (root.dataset.state === 'away') root.dataset.state = stateBefore;
  if (shown instanceof NoResponse) hideProblem();
  announce('The service is back');
}

/**
 * Shows an error; returns the number of the control point that it names, or -1.
 * @param {Error} error @param {State} state @param {(() => void) | null} retry  for a button that does it again
 */
export function showProblem(error, state, retry = null) {
  shown = error;
  again = retry ?? askNow;
  // The issues of a surface that was not opened point into that surface.
  const isAboutOpen = !(error instanceof NotOpened);
  const reason = isAboutOpen ? error : error.reason;
  const isRefusal = reason instanceof ServiceError;
  const isUnknownSurface = isRefusal && reason.code === 'unknown_surface';
  // The error lists all ids of examples; the button `problem-example` shows them with pictures instead.
  const issues = (isRefusal && !isUnknownSurface) || reason instanceof Unreadable ? reason.errors : [];
  const { title, detail } = describeError(error);
  write('problem-title', title);
  // `detail` names only the kind of the error: the line of a single issue says it more exactly.
  write('problem-detail', issues.length === 1 ? '' : detail);
  element('problem-errors', HTMLElement).replaceChildren(...issues.slice(0, 5).map(buildLine));
  const index = (isAboutOpen ? issues : []).map((issue) => findNamedPoint(issue, state.net)).find((i) => i >= 0) ?? -1;
  const point = button('problem-point');
  point.hidden = index < 0;
  point.dataset.index = String(index);
  point.textContent = `Show control point ${index + 1}`;
  button('problem-example').hidden = !isUnknownSurface;
  button('problem-undo').hidden = !isRefusal || !isAboutOpen || !state.history.canUndo;
  button('problem-key').hidden = !(isRefusal && isAboutKeys(reason.code));
  button('problem-retry').hidden = !(reason instanceof NoResponse || (reason instanceof Stopped && retry !== null));
  element('problem', HTMLElement).hidden = false;
  return index;
}

/** @param {Error} error @returns {{title: string, detail: string}} */
function describeError(error) {
  if (error instanceof NotOpened) {
    const inner = describeError(error.reason);
    const isOfSurface = error.reason instanceof Unreadable || (error.reason instanceof ServiceError && !HAS_TITLE.has(error.reason.code));
    const what = error.what.replace(/^the /, 'The ');
    return isOfSurface ? { ...inner, title: `${what} ${/^\d+ files$/.test(what) ? 'were' : 'was'} not ${error.verb}` } : inner;
  }
  if (error instanceof Unreadable) return { title: 'Not readable', detail: error.message };
  if (error instanceof NoResponse) {
    const detail = 'Nothing answers at its address. Your changes are kept. The page asks again by itself.';
    return { title: 'The service is away', detail };
  }
  if (error instanceof Stopped) {
    return { title: 'Stopped', detail: `${error.message} was stopped. The page shows what it showed before.` };
  }
  if (!(error instanceof ServiceError)) return { title: 'The page made a mistake', detail: String(error) };
  if (error.code === 'unknown_surface') {
    const detail = 'The address may be incomplete, or the surface was removed. Open an example, or a surface of your own.';
    return { title: 'There is no surface at this address', detail };
  }
  if (isAboutKeys(error.code)) return { title: 'A key is needed', detail: error.message };
  const title = error.status < 500 ? 'The service refuses this' : 'The service could not do this';
  return { title, detail: error.message };
}

export function hideProblem() {
  element('problem', HTMLElement).hidden = true;
}

/** @param {Issue} issue */
function buildLine(issue) {
  const item = makeElement('li', `${issue.detail} `);
  const texts = [issue.got && `Got ${issue.got}`, issue.needed && `needed ${issue.needed}`];
  const values = texts.filter(Boolean).join(', ');
  if (values) item.append(`${values}. `);
  const location = issue.pointer ?? issue.parameter ?? issue.header;
  if (location) item.append(makeElement('code', location));
  return item;
}

/**
 * The number of the control point whose coordinates or weight an issue points to, or −1.
 * @param {Issue} issue @param {Net} net
 */
function findNamedPoint(issue, net) {
  const [root, ...path] = parsePointer(issue.pointer ?? '');
  if (root !== 'surface') return -1;
  // A pointer to one coordinate of a point has one key more than the point.
  const beginsPath = (/** @type {(string | number)[]} */ keys) => (
    keys.length <= path.length && keys.every((key, i) => String(key) === path[i])
  );
  return net.handles.findIndex(({ point, weights, indices }) => (
    beginsPath(point) || beginsPath([...weights, ...indices])
  ));
}
