// The API key of the user, if the service needs a key. A dialog asks for the key, every request to the
// service sends it, and it is forgotten when the tab is closed. The key is never in a URL.

import { announce, button, element, input, write } from './page.js';

const STORAGE_KEY = 'surface-key';

/** Texts that explain why a key is needed, by the code of the problem. */
const REASONS = new Map([
  ['key_needed', 'To compute and to store, this service needs a key.'],
  ['key_unknown', 'The service does not know this key; it may have been replaced.'],
]);

/** Has an event `change` when there is another key, or none. */
export const keyChanges = new EventTarget();

let key = readKey();
/** The result of the open dialog. @type {Promise<boolean> | null} */
let asking = null;
/** Whether the user closed the dialog without the needed key: then only its buttons open it again, and no
 *  request. */
let isDeclined = false;

/** The present key; empty if there is none. */
export const currentKey = () => key;

/** Whether a problem is about keys. @param {string} code */
export const isAboutKeys = (code) => REASONS.has(code);

/**
 * Asks for a key; returns whether the present key differs from the key that was sent.
 * @param {string} code  of the problem @param {string} sentKey
 */
export async function requestKey(code, sentKey) {
  if (key !== sentKey) return true;
  if (isDeclined) return false;
  asking ??= ask(code).finally(() => { asking = null; });
  return asking;
}

/** Handles the dialog, and its buttons in the bar and in problems. @param {() => void} onNewKey */
export function watchKey(onNewKey) {
  const open = async () => {
    isDeclined = false;
    // If the user opens the dialog, the service has not refused the present key.
    if (await requestKey(key ? '' : 'key_needed', key)) onNewKey();
  };
  button('api-key').addEventListener('click', open);
  button('problem-key').addEventListener('click', open);
  button('access-forget').addEventListener('click', () => {
    storeKey('');
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
  write('access-why', REASONS.get(code) ?? 'This tab has a key. A new key replaces it.');
  button('access-forget').hidden = key === '';
  button('api-key').hidden = false;
  dialog.returnValue = '';
  if (!dialog.open) dialog.showModal();
  field.focus();
  return new Promise((resolve) => {
    dialog.addEventListener('close', () => {
      const newKey = dialog.returnValue === 'use' ? field.value : '';
      field.value = '';
      isDeclined = newKey === '' && code !== '';
      if (newKey) storeKey(newKey);
      resolve(newKey !== '');
    }, { once: true });
  });
}

function show() {
  if (key) button('api-key').hidden = false;
}

/** @param {string} newKey */
function storeKey(newKey) {
  key = newKey;
  try {
    if (newKey) sessionStorage.setItem(STORAGE_KEY, newKey);
    else sessionStorage.removeItem(STORAGE_KEY);
  } catch {
    // The browser does not allow storage: the key stays in the memory of the page.
  }
  keyChanges.dispatchEvent(new Event('change'));
}

function readKey() {
  try {
    return sessionStorage.getItem(STORAGE_KEY) ?? '';
  } catch {
    return '';
  }
}
