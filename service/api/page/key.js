// The API key of the user, if the service needs one: a dialog asks for it, every request to the
// service sends it, and the tab forgets it when it is closed. It is never in a URL.

import { announce, button, element, input, write } from './page.js';

const PLACE = 'surface-key';

/** Texts that explain why a key is needed, by the code of the problem. */
const WHY = new Map([
  ['key_needed', 'This service computes and stores for those who have a key.'],
  ['key_unknown', 'The service does not know this key; it may have been replaced.'],
]);

let key = kept();
/** The result of the open dialog. @type {Promise<boolean> | null} */
let asking = null;
/** Whether the user closed the dialog: then it opens again by its button, not for each request. */
let isDeclined = false;

/** The present key; empty if there is none. */
export const currentKey = () => key;

/** The header with the key. @returns {Record<string, string>} */
export const credentials = () => (key ? { Authorization: `Bearer ${key}` } : {});

/** Whether a problem is about keys. @param {string} code */
export const isAboutKeys = (code) => WHY.has(code);

/**
 * Asks for a key; returns whether the present key differs from the one that was sent.
 * @param {string} code  of the problem @param {string} sent
 */
export async function anotherKey(code, sent) {
  if (key !== sent) return true;
  if (isDeclined) return false;
  asking ??= ask(code).finally(() => { asking = null; });
  return asking;
}

/** Handles the dialog, its button in the bar and that of problems. @param {() => void} again  called when there is a new key */
export function watchKey(again) {
  const open = async () => {
    isDeclined = false;
    // If the user opens the dialog, the service has not refused the present key.
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
  // Pasted texts often begin or end with a space or a line feed.
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
    // This browser denies its storage: the page keeps the key itself.
  }
}

function kept() {
  try {
    return sessionStorage.getItem(PLACE) ?? '';
  } catch {
    return '';
  }
}
