// Opens surfaces: examples of the service, pasted texts, dropped files.

import { parseSurface } from './documents.js';
import { button, element, input, makeElement, write } from './page.js';
import { examples, readFile, Refusal, store, surfaceById } from './service.js';
import { perform } from './work.js';

/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('./service.js').Example} Example */
/** @typedef {import('./service.js').Issue} Issue */
/** @typedef {import('./service.js').Reading} Reading */
/** @typedef {import('./state.js').About} About */

/** The most faces whose reason the description has. */
const MAX_REASONS = 3;

export class Library {
  /**
   * @param {() => void} waiting  called before a surface is requested
   * @param {(surface: Surface, about: About) => void} open @param {(error: Error) => void} failed
   */
  constructor(waiting, open, failed) {
    this.waiting = waiting;
    this.open = open;
    this.failed = failed;
    /** @type {Example[]} */
    this.examples = [];
    /** Media types of the files that only the service reads, by the suffix of the file. @type {Record<string, string>} */
    this.mediaTypes = JSON.parse(input('file').dataset.mediaTypes ?? '{}');
    /** Media types of CAD files. @type {string[]} */
    this.cadTypes = JSON.parse(input('file').dataset.cadTypes ?? '[]');
    /** Why the service does not read a file, by its suffix. @type {Record<string, Issue>} */
    this.refusedFiles = JSON.parse(input('file').dataset.refusedFiles ?? '{}');
    /** Aborts the requests for a surface that will not be opened, as the user chose another one. */
    this.outdated = new AbortController();
    this.dialog = element('library', HTMLDialogElement);
    button('open').addEventListener('click', () => this.dialog.showModal());
    button('paste-open').addEventListener('click', () => this.openPasted());
    input('file').addEventListener('change', () => {
      const [file] = input('file').files ?? [];
      if (file) void this.openFile(file);
      input('file').value = '';
    });
    this.watchDrops();
    this.listed = this.list();
  }

  /** Lists the examples of the service. */
  async list() {
    this.examples = await perform('Asking for the list of examples', examples);
    const items = this.examples.map((example) => {
      const item = document.createElement('li');
      const chooser = document.createElement('button');
      chooser.type = 'button';
      chooser.dataset.example = example.id;
      const picture = Object.assign(new Image(192, 144), { loading: 'lazy', alt: '' });
      picture.src = `page/${example.id}.webp`;
      chooser.append(picture, makeElement('strong', example.title), makeElement('span', plain(example.description)));
      chooser.addEventListener('click', () => void this.openById(example.id));
      item.append(chooser);
      return item;
    });
    element('examples', HTMLElement).replaceChildren(...items);
  }

  /** Another surface will be opened: aborts the requests for the one before. */
  replaceOutdated() {
    this.outdated.abort();
    this.outdated = new AbortController();
    return this.outdated.signal;
  }

  /** Opens an example, or the stored surface with an id. @param {string} id */
  async openById(id) {
    this.dialog.close();
    this.waiting();
    try {
      const listed = this.examples.find((item) => item.id === id);
      const opening = perform(
        `Opening ${listed?.title ?? 'the surface'}`, (signal) => surfaceById(id, signal), this.replaceOutdated(),
      );
      const [surface] = await Promise.all([opening, this.listed]);
      const example = this.examples.find((item) => item.id === id);
      this.show(surface, {
        title: example?.title ?? chooseTitle(surface),
        description: plain(example?.description ?? 'A stored surface, opened by its address.'),
        origin: id,
      });
    } catch (error) {
      this.failed(/** @type {Error} */ (error));
    }
  }

  openPasted() {
    const area = element('paste', HTMLTextAreaElement);
    this.openText(area.value, 'pasted');
  }

  /** Opens a surface as JSON. @param {string} text @param {string} source  in words */
  openText(text, source) {
    try {
      const surface = parseSurface(text);
      this.show(surface, {
        title: chooseTitle(surface), description: `A surface of yours, ${source}.`, origin: '',
      });
    } catch (error) {
      element('paste-problem', HTMLElement).hidden = false;
      write('paste-problem', `The text is not the JSON of a surface. ${/** @type {Error} */ (error).message}`);
      if (!this.dialog.open) this.dialog.showModal();
    }
  }

  /** Opens a JSON file here; sends other files to the service, and opens the surface in them. @param {File} file */
  async openFile(file) {
    const suffix = file.name.toLowerCase().split('.').pop() ?? '';
    const mediaType = this.mediaTypes[suffix];
    const refused = this.refusedFiles[suffix];
    if (mediaType === undefined && refused !== undefined) {
      this.dialog.close();
      this.failed(new Refusal({ status: 415, detail: refused.detail, errors: [refused] }));
      return;
    }
    if (mediaType === undefined) {
      this.openText(await file.text(), `from ${file.name}`);
      return;
    }
    this.dialog.close();
    this.waiting();
    try {
      if (this.cadTypes.includes(mediaType)) {
        const { surface, reading } = await perform(
          `Reading ${file.name}`, (signal) => readFile(file, mediaType, signal), this.replaceOutdated(),
        );
        this.show(surface, { title: file.name, description: describeReading(reading), origin: '' });
        return;
      }
      const { id, surface } = await perform(`Reading ${file.name}`, async (signal) => {
        const stored = await store(file, mediaType, signal);
        return { id: stored.id, surface: await surfaceById(stored.id, signal) };
      }, this.replaceOutdated());
      this.show(surface, { title: file.name, description: 'A file of yours, read by the service.', origin: id });
    } catch (error) {
      this.failed(/** @type {Error} */ (error));
    }
  }

  /** @param {Surface} surface @param {About} about */
  show(surface, about) {
    element('paste-problem', HTMLElement).hidden = true;
    if (this.dialog.open) this.dialog.close();
    this.open(surface, about);
  }

  watchDrops() {
    const root = document.documentElement;
    addEventListener('dragover', (event) => {
      if (!event.dataTransfer?.types.includes('Files')) return;
      event.preventDefault();
      root.dataset.dropping = '';
    });
    addEventListener('dragleave', (event) => {
      if (event.relatedTarget === null) delete root.dataset.dropping;
    });
    addEventListener('drop', (event) => {
      delete root.dataset.dropping;
      const [file] = event.dataTransfer?.files ?? [];
      if (!file) return;
      event.preventDefault();
      void this.openFile(file);
    });
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

/** What was read from a CAD file, in words: also which faces were not. @param {Reading} reading */
function describeReading({ faces, skipped_faces: skipped }) {
  const read = `A file of yours, read by the service: ${faces} ${faces === 1 ? 'face' : 'faces'}.`;
  if (skipped.length === 0) return read;
  const reasons = skipped.slice(0, MAX_REASONS).map(({ entity, reason }) => `${entity}: ${reason}`);
  const rest = skipped.length > MAX_REASONS ? '; …' : '';
  return `${read} Not in the surface: ${skipped.length} more (${reasons.join('; ')}${rest}).`;
}

/** A description without its marks of code. @param {string} text */
function plain(text) {
  return text.replaceAll('`', '');
}

/** @param {Surface} surface */
function chooseTitle(surface) {
  return typeof surface.name === 'string' && surface.name ? surface.name : 'Untitled surface';
}
