// The key of whoever works here, where the service needs one: asked for in a dialog, sent with every
// request to the service, and gone with the tab. It never stands in a URL.

import { announce, button, element, input, write } from './page.js';

const PLACE = 'surface-key';

/** What the service says of a key, by the code of its problem. */
const WHY = new Map([
  ['key_needed', 'This service computes and stores for those who have a key.'],
  ['key_unknown', 'The service does not know this key; it may have been replaced.'],
]);

let key = kept();
/** Whoever waits for the dialog that is open. @type {Promise<boolean> | null} */
let asking = null;
/** Somebody closed the dialog: it comes back when it is asked for, not with every request. */
let isDeclined = false;

/** The key that is sent now; empty for none. */
export const currentKey = () => key;

/** The header that brings the key. @returns {Record<string, string>} */
export const credentials = () => (key ? { Authorization: `Bearer ${key}` } : {});

/** Whether a problem is about keys. @param {string} code */
export const isAboutKeys = (code) => WHY.has(code);

/**
 * Asks for a key; tells whether there is another one now than the one that was sent.
 * @param {string} code  of the problem @param {string} sent
 */
export async function anotherKey(code, sent) {
  if (key !== sent) return true;
  if (isDeclined) return false;
  asking ??= ask(code).finally(() => { asking = null; });
  return asking;
}

/** The dialog, its button in the bar and that of problems. @param {() => void} again  there is a key now */
export function watchKey(again) {
  const open = async () => {
    isDeclined = false;
    // Somebody who has a key and looks at it was not asked for another one.
    if (await anotherKey(key ? '' : 'key_needed', key)) again();
  };
  button('api-key').addEventListener('click', open);
  button('problem-key').addEventListener('click', open);
  button('access-forget').addEventListener('click', () => {
    keep('');
    element('access', HTMLDialogElement).close();
    announce('The key is forgotten');
  });
  const field = input('access-key');
  // What is pasted often has a space or a line's end at its edge.
  field.addEventListener('input', () => { field.value = field.value.trim(); });
  show();
}

/** Opens the dialog, and waits until it closes. @param {string} code @returns {Promise<boolean>} */
function ask(code) {
  const dialog = element('access', HTMLDialogElement);
  const field = input('access-key');
  field.value = '';
  write('access-why', WHY.get(code) ?? 'A key is kept for this tab. Another one takes its place.');
  button('access-forget').hidden = key === '';
  button('api-key').hidden = false;
  dialog.returnValue = '';
  if (!dialog.open) dialog.showModal();
  field.focus();
  return new Promise((resolve) => {
    dialog.addEventListener('close', () => {
      const given = dialog.returnValue === 'use' ? field.value : '';
      field.value = '';
      isDeclined = given === '' && code !== '';
      if (given) keep(given);
      resolve(given !== '');
    }, { once: true });
  });
}

function show() {
  if (key) button('api-key').hidden = false;
}

/** @param {string} given */
function keep(given) {
  key = given;
  try {
    if (given) sessionStorage.setItem(PLACE, given);
    else sessionStorage.removeItem(PLACE);
  } catch {
    // A browser that keeps nothing: the key lives as long as the page.
  }
}

function kept() {
  try {
    return sessionStorage.getItem(PLACE) ?? '';
  } catch {
    return '';
  }
}
