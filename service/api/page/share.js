// Export: the surface as a link, as a command, as a snippet, and as files.

import { element, makeElement, write, announce, button } from './page.js';
import { meshQuery, meshOptions } from './settings.js';
import { mesh } from './mesh.js';
import { client, define, readsArePrivate } from './service.js';
import { buildSnippet } from './snippet.js';
import { perform } from './work.js';

/** @typedef {import('./state.js').State} State */
/** @typedef {import('surface-service').Format} Format */

/**
 * @param {State} state @param {(id: string) => string} describeAddress  of this page, with a surface
 * @param {(error: Error) => void} failed
 */
export function watchShare(state, describeAddress, failed) {
  const link = async () => client.resolve(describeAddress(await idOf(state)));
  const builders = { 'copy-link': link, 'copy-curl': curl, 'copy-snippet': snippet };
  Object.entries(builders).forEach(([id, build]) => button(id).addEventListener('click', async () => {
    try {
      await copy(await build(state), /** @type {HTMLElement} */ (button(id)).textContent ?? '');
    } catch (error) {
      failed(/** @type {Error} */ (error));
    }
  }));
  button('save-json').addEventListener('click', () => {
    save(new Blob([JSON.stringify({ surface: state.surface })], { type: 'application/json' }), `${fileName(state)}.surface.json`);
    announce('Downloaded the surface as JSON');
  });
  perform('Asking for the list of formats', (signal) => client.formats({ signal })).then(({ formats }) => {
    const chips = formats.map((format) => buildButton(format, state, failed));
    element('formats', HTMLElement).replaceChildren(...chips);
  }).catch(failed);
  state.listen((change) => {
    if (change === 'opened') element('export', HTMLFieldSetElement).disabled = false;
    element('share-stores', HTMLElement).hidden = state.address !== '';
  });
}

/**
 * The id of this document in the service. An edited document, or one from a file, is stored to get an id.
 * @param {State} state
 */
async function idOf(state) {
  if (state.address) return state.address;
  const { surface } = state;
  const { id } = await perform('Storing the surface', (signal) => client.store(define(surface), { signal }));
  state.setAddress(surface, id);
  return id;
}

/** The path of the mesh by its id. @param {State} state */
async function meshPath(state) {
  return `v1/surfaces/${await idOf(state)}/mesh.glb?${meshQuery(state.settings, state.surface)}`;
}

/** @param {State} state */
async function curl(state) {
  const url = client.resolve(await meshPath(state));
  // The command does not contain the key; the shell replaces the variable by it.
  const key = readsArePrivate() ? '-H "Authorization: Bearer $SURFACE_KEY" ' : '';
  return `curl ${key}-o ${fileName(state)}.glb '${url}'`;
}

/** @param {State} state */
async function snippet(state) {
  const path = await meshPath(state);
  // The canonical address, which never changes, is in the response, and so is the error if there is no mesh.
  const response = await perform('Asking for the address of the mesh', (signal) => client.request(path, {}, { signal }));
  void response.body?.cancel();
  const canonical = /<([^>]+)>; rel="canonical"/.exec(response.headers.get('Link') ?? '')?.[1];
  return buildSnippet(client.resolve(canonical ?? path), fileName(state), readsArePrivate());
}

/** @param {string} text @param {string} label */
async function copy(text, label) {
  element('copied-private', HTMLElement).hidden = !readsArePrivate();
  try {
    await navigator.clipboard.writeText(text);
    write('copied', `Copied: ${text}`);
    announce(`${label}: copied`);
  } catch {
    // Without permission for the clipboard, or without https, the text is shown, and the user can copy it by hand.
    write('copied', text);
    announce(`${label}: shown, to be copied`);
  }
}

/** A button that downloads one format. @param {Format} format @param {State} state @param {(error: Error) => void} failed */
function buildButton(format, state, failed) {
  const download = /** @type {HTMLButtonElement} */ (makeElement('button', `.${format.suffix}`));
  download.type = 'button';
  download.dataset.format = format.suffix;
  download.title = format.title;
  download.setAttribute('aria-label', `${format.title}, .${format.suffix}`);
  download.addEventListener('click', async () => {
    try {
      // A file needs no curvatures. The number of patches (1) matters only for a coarse mesh.
      const options = meshOptions({ ...state.settings, look: 'shaded' }, state.surface, 1, false);
      const request = { surface: state.surface, ...options };
      const name = `${fileName(state)}.${format.suffix}`;
      const { content } = await perform(`Making ${name}`, (signal, tell) => (
        mesh(request, { format: format.name, signal, tell })));
      save(new Blob([content], { type: format.media_type }), name);
      announce(`Downloaded ${format.title}`);
    } catch (error) {
      failed(/** @type {Error} */ (error));
    }
  });
  return download;
}

/** @param {Blob} content @param {string} name */
function save(content, name) {
  const anchor = document.createElement('a');
  anchor.href = URL.createObjectURL(content);
  anchor.download = name;
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(anchor.href), 10_000);
}

/** @param {State} state */
function fileName(state) {
  const name = String(state.surface.name ?? 'surface');
  return name.replace(/[^A-Za-z0-9._-]+/g, '-').replace(/^[-.]+|[-.]+$/g, '') || 'surface';
}
