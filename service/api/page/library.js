// The dialog in which a person opens a surface: the examples of the service, a pasted text, files.

import { watchDrops } from './drops.js';
import { loadLater } from './load-later.js';
import { button, element, input, makeElement, write } from './page.js';
import { client } from './service.js';
import { perform } from './work.js';

/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('surface-service').SurfaceSummary} Example */
/** @typedef {import('./identify.js').Facts} Facts */
/** @typedef {import('./opening.js').Opening} Opening */
/** @typedef {import('./read-files.js').MeshFile} MeshFile */
/** @typedef {import('./read-files.js').Source} Source */
/** @typedef {import('./state.js').About} About */

export class Library {
  /** @param {Opening} opening @param {(mesh: MeshFile) => Promise<boolean>} checkMesh  false if no surface is open */
  constructor(opening, checkMesh) {
    this.opening = opening;
    this.checkMesh = checkMesh;
    /** @type {Example[]} */
    this.examples = [];
    /** @type {Facts} */
    this.facts = JSON.parse(input('file').dataset.files ?? '');
    this.dialog = element('library', HTMLDialogElement);
    button('open').addEventListener('click', () => {
      this.dialog.showModal();
      this.showPictures().catch(() => {}); // the list is complete without them
    });
    button('paste-open').addEventListener('click', () => void this.openPasted());
    watchDrops((sources) => void this.openSources(sources));
    this.listed = this.list();
  }

  /** Lists the examples of the service. */
  async list() {
    this.examples = await perform('Asking for the list of examples', (signal) => client.surfaces({ signal }));
    const items = this.examples.map((example) => {
      const item = document.createElement('li');
      const chooser = document.createElement('button');
      chooser.type = 'button';
      chooser.dataset.example = example.id;
      const picture = Object.assign(new Image(192, 128), { loading: 'lazy', fetchPriority: 'low', alt: '' });
      picture.dataset.picture = example.id;
      chooser.append(picture, makeElement('strong', example.title), makeElement('span', plain(example.description)));
      chooser.addEventListener('click', () => void this.openById(example.id));
      item.append(chooser);
      return item;
    });
    element('examples', HTMLElement).replaceChildren(...items);
  }

  async showPictures() {
    await this.listed;
    const { showPictures } = await loadLater();
    await showPictures(document.querySelectorAll('img[data-picture]:not([src])'));
  }

  /** Opens an example, or the stored surface with an id. @param {string} id */
  async openById(id) {
    this.close();
    const title = this.examples.find((item) => item.id === id)?.title ?? 'the surface';
    await this.opening.start(title, async (outdated) => {
      const reading = perform(`Opening ${title}`, (signal) => client.surface(id, { signal }), outdated);
      const [{ surface }] = await Promise.all([reading, this.listed]);
      const example = this.examples.find((item) => item.id === id);
      const about = {
        title: example?.title ?? surface.name ?? 'Untitled surface',
        description: plain(example?.description ?? 'A stored surface, opened by its address.'),
        origin: id,
      };
      return { surface, about };
    });
  }

  /** Opens the text in the dialog, which stays open if the text cannot be read. */
  async openPasted() {
    const content = new Blob([element('paste', HTMLTextAreaElement).value]);
    await this.opening.start('the text', async (outdated) => {
      const wish = await this.read('the text', [{ name: '', content }], outdated);
      this.close();
      return wish;
    }, ({ errors: [{ detail, needed }] }) => {
      element('paste-problem', HTMLElement).hidden = false;
      write('paste-problem', needed ? `${detail} Needed: ${needed}.` : detail);
    });
  }

  /** Opens files and texts, several as one group. @param {Source[]} sources */
  async openSources(sources) {
    this.close();
    const [{ name }] = sources;
    if (sources.length === 1 && await this.isMesh(sources[0])) return;
    const what = sources.length > 1 ? `${sources.length} files` : name || 'the text';
    await this.opening.start(what, (outdated) => this.read(what, sources, outdated));
  }

  /** Whether a file is a mesh, which the page checks. @param {Source} source */
  async isMesh(source) {
    try {
      const { findMesh } = await loadLater();
      const mesh = await findMesh(source, this.facts);
      return mesh !== null && await this.checkMesh(mesh);
    } catch {
      return false; // reading it as a surface says why it cannot be read
    }
  }

  /** @param {string} what @param {Source[]} sources @param {AbortSignal} outdated @returns {Promise<import('./opening.js').Wish>} */
  async read(what, sources, outdated) {
    const { surface, settings, title, description } = await perform(`Reading ${what}`, async (signal, tell) => {
      const { readSources } = await loadLater();
      return readSources(sources, this.facts, signal, tell);
    }, outdated);
    return { surface, settings, about: { title, description, origin: '' } };
  }

  /** Opens a surface of the page itself. @param {Surface} surface @param {About} about */
  show(surface, about) {
    this.close();
    void this.opening.start(about.title, async () => ({ surface, about }));
  }

  /** Closes this dialog, and others above which a file was dropped: what opens is below them. */
  close() {
    element('paste-problem', HTMLElement).hidden = true;
    for (const dialog of document.querySelectorAll('dialog[open]:not(#access)')) /** @type {HTMLDialogElement} */ (dialog).close();
  }
}

/** Shows the title and the description of the surface that is open. @param {About} about */
export function showAbout({ title, description, origin }) {
  write('title', title);
  write('description', description);
  document.title = `${title} · Surface Service`;
  document.querySelectorAll('[data-example]').forEach((chooser) => {
    const isOpen = chooser.getAttribute('data-example') === origin;
    if (isOpen) chooser.setAttribute('aria-current', 'true');
    else chooser.removeAttribute('aria-current');
  });
}

/** A description without its marks of code. @param {string} text */
function plain(text) {
  return text.replaceAll('`', '');
}
