// The drafts in the dialog of surfaces: what is kept and where, a button for each, and one that forgets
// all of them.

import { currentKey, keyChanges } from './key.js';
import { announce, button, element, input, makeElement, write } from './page.js';
import { describeEdits } from './visits.js';

/** @typedef {import('./draft-stores.js').DraftRecord} DraftRecord */

const KEEP_KEY = 'surface-keep-drafts';

/** Whether a key is in use: drafts then stay in the tab. */
export const hasKey = () => currentKey() !== '';

/** Whether the user ticked "Keep on this device". */
export function keepsAll() {
  try {
    return localStorage.getItem(KEEP_KEY) === '1';
  } catch {
    return false;
  }
}

/** @param {import('./drafts.js').Drafts} drafts @param {import('./visits.js').Visits} visits */
export function watchDraftList(drafts, visits) {
  const dialog = element('library', HTMLDialogElement);
  const show = () => showList(drafts, (id) => {
    dialog.close();
    void visits.openDraft(id);
  });
  button('open').addEventListener('click', show);
  input('drafts-keep').addEventListener('change', () => {
    keepAll(input('drafts-keep').checked);
    visits.save();
    showPlace(drafts);
  });
  button('drafts-forget').addEventListener('click', () => element('forget', HTMLDialogElement).showModal());
  element('forget', HTMLDialogElement).addEventListener('close', async ({ target }) => {
    if (/** @type {HTMLDialogElement} */ (target).returnValue !== 'forget') return;
    const count = await drafts.forgetAll();
    await show();
    announce(count === 1 ? '1 draft is forgotten' : `${count} drafts are forgotten`);
    element('library-close', HTMLElement).focus();
  });
  keyChanges.addEventListener('change', () => visits.save());
  visits.kept = () => {
    const isLost = visits.place === 'nowhere';
    write('edited', isLost ? 'edited, not kept' : 'edited');
    if (isLost) announce('The edits are not kept: there is no room for a draft in this browser.');
  };
}

/** @param {import('./drafts.js').Drafts} drafts @param {(id: string) => void} open */
async function showList(drafts, open) {
  const records = await drafts.list();
  const live = await Promise.all(records.map(({ tab }) => drafts.tab.isLive(tab)));
  const items = records.map((record, i) => {
    const item = document.createElement('li');
    const opener = document.createElement('button');
    opener.type = 'button';
    opener.dataset.draft = record.id;
    const where = live[i] && navigator.locks ? ', open in another tab' : '';
    opener.append(
      makeElement('strong', record.about.title),
      makeElement('span', `${describeEdits(record)}, ${describeTime(record.when)}${where}`),
    );
    opener.addEventListener('click', () => open(record.id));
    item.append(opener);
    return item;
  });
  element('draft-list', HTMLElement).replaceChildren(...items);
  button('drafts-forget').hidden = items.length === 0;
  write('forget-count', items.length === 1 ? 'The draft' : `All ${items.length} drafts`);
  showPlace(drafts);
}

/** Says where drafts are kept. @param {import('./drafts.js').Drafts} drafts */
function showPlace(drafts) {
  const isPrivate = hasKey();
  element('drafts-keep-switch', HTMLElement).hidden = !isPrivate;
  input('drafts-keep').checked = keepsAll();
  const place = 'The last twenty surfaces that you edited are kept here with all steps';
  if (isPrivate && !keepsAll()) write('drafts-place', `${place}, in this tab only, because an API key is in use.`);
  else if (drafts.deviceError) write('drafts-place', `${place}, in this tab only: this browser keeps nothing on the device.`);
  else write('drafts-place', `${place}, on this device only.`);
}

/** @param {boolean} isKept */
function keepAll(isKept) {
  try {
    if (isKept) localStorage.setItem(KEEP_KEY, '1');
    else localStorage.removeItem(KEEP_KEY);
  } catch {
    // Without storage the choice cannot be kept, and drafts neither.
  }
}

/** @param {number} time  in milliseconds since 1970 */
function describeTime(time) {
  const minutes = Math.round((Date.now() - time) / 60_000);
  if (minutes < 1) return 'just now';
  const format = new Intl.RelativeTimeFormat('en', { numeric: 'always' });
  if (minutes < 60) return format.format(-minutes, 'minute');
  if (minutes < 48 * 60) return format.format(-Math.round(minutes / 60), 'hour');
  return format.format(-Math.round(minutes / 1440), 'day');
}
