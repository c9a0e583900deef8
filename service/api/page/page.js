// Small functions for the elements of the page, found by their ids.

/**
 * @template {HTMLElement} E
 * @param {string} id @param {new () => E} kind
 * @returns {E}
 */
export function element(id, kind) {
  const node = document.getElementById(id);
  if (!(node instanceof kind)) throw new TypeError(`no ${kind.name} is called ${id}`);
  return node;
}

/** @param {string} id */
export const button = (id) => element(id, HTMLButtonElement);

/** @param {string} id */
export const input = (id) => element(id, HTMLInputElement);

/** @param {string} id @param {string} text */
export function write(id, text) {
  const node = element(id, HTMLElement);
  if (node.textContent !== text) node.textContent = text;
}

/** The title of the open surface. */
export const readTitle = () => element('title', HTMLElement).textContent ?? '';

/** The radio buttons of one name. @param {string} name */
export function radios(name) {
  return /** @type {HTMLInputElement[]} */ ([...document.querySelectorAll(`input[name="${name}"]`)]);
}

/** @param {string} name @param {string} value */
export function checkRadio(name, value) {
  radios(name).forEach((radio) => { radio.checked = radio.value === value; });
}

/** @param {string} name */
export function getChecked(name) {
  return radios(name).find((radio) => radio.checked)?.value ?? '';
}

/** A new element that holds a text. @param {string} tag @param {string} text */
export function makeElement(tag, text) {
  const node = document.createElement(tag);
  node.textContent = text;
  return node;
}

/** Announces a text to users of screen readers. @param {string} text */
export function announce(text) {
  write('status', text);
}
