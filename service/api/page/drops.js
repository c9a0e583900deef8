// Files, folders and texts that a person drops on the page, pastes into it, or chooses.

import { input } from './page.js';

/** @typedef {import('./read-files.js').Source} Source */

/** The most files that are opened as one group. */
export const MAX_FILES = 200;

/** @param {(sources: Source[]) => void} open  called with at least one source */
export function watchDrops(open) {
  const root = document.documentElement;
  const give = (/** @type {Source[]} */ sources) => { if (sources.length > 0) open(sources); };

  addEventListener('dragover', (event) => {
    const types = event.dataTransfer?.types ?? [];
    if (!types.includes('Files') && (isField(event.target) || !types.includes('text/plain'))) return;
    event.preventDefault();
    root.dataset.dropping = '';
  });
  addEventListener('dragleave', (event) => {
    if (event.relatedTarget === null) delete root.dataset.dropping;
  });
  addEventListener('dragend', () => { delete root.dataset.dropping; });
  addEventListener('drop', (event) => {
    delete root.dataset.dropping;
    const { dataTransfer } = event;
    if (dataTransfer === null) return;
    if (dataTransfer.types.includes('Files')) {
      event.preventDefault();
      void listFiles(dataTransfer).then(give);
    } else if (!isField(event.target)) {
      event.preventDefault();
      give(fromText(dataTransfer.getData('text/plain')));
    }
  });
  addEventListener('paste', (event) => {
    const { clipboardData } = event;
    if (clipboardData === null) return;
    const files = fromFiles([...clipboardData.files]);
    if (files.length === 0 && isField(event.target)) return;
    event.preventDefault();
    give(files.length > 0 ? files : fromText(clipboardData.getData('text/plain')));
  });
  input('file').addEventListener('change', () => {
    give(fromFiles([...input('file').files ?? []]));
    input('file').value = '';
  });
}

/** @param {string} text @returns {Source[]} */
function fromText(text) {
  return text.trim() === '' ? [] : [{ name: '', content: new Blob([text]) }];
}

/** @param {File[]} files @returns {Source[]} */
function fromFiles(files) {
  return files.map((file) => ({ name: file.name, content: file }));
}

/** The files in a drop, also those in its folders, in the order of their names. @param {DataTransfer} transfer @returns {Promise<Source[]>} */
async function listFiles(transfer) {
  // The browser empties the list of items when the event has ended.
  const items = [...transfer.items].filter(({ kind }) => kind === 'file')
    .map((item) => ({ entry: item.webkitGetAsEntry(), file: item.getAsFile() }));
  /** @type {Source[]} */
  const sources = [];
  for (const { entry, file } of items) {
    if (entry?.isDirectory) await addFolder(/** @type {FileSystemDirectoryEntry} */ (entry), sources);
    else if (file) sources.push(...fromFiles([file]));
  }
  return sources;
}

/** Adds the files of a folder and of its folders; hidden ones are left out. @param {FileSystemDirectoryEntry} folder @param {Source[]} sources */
async function addFolder(folder, sources) {
  const reader = folder.createReader();
  /** @type {FileSystemEntry[]} */
  const entries = [];
  for (;;) {
    // The browser returns a part of the entries at a time, and at the end none.
    const next = await new Promise((/** @type {(list: FileSystemEntry[]) => void} */ resolve) => {
      reader.readEntries(resolve, () => resolve([]));
    });
    if (next.length === 0) break;
    entries.push(...next);
  }
  entries.sort((a, b) => a.name.localeCompare(b.name, 'en', { numeric: true }));
  for (const entry of entries) {
    if (sources.length > MAX_FILES) return; // too many, as the reader says
    if (entry.name.startsWith('.')) continue;
    if (entry.isDirectory) await addFolder(/** @type {FileSystemDirectoryEntry} */ (entry), sources);
    else sources.push(...fromFiles(await readEntry(/** @type {FileSystemFileEntry} */ (entry))));
  }
}

/** @param {FileSystemFileEntry} entry @returns {Promise<File[]>} */
function readEntry(entry) {
  return new Promise((resolve) => { entry.file((file) => resolve([file]), () => resolve([])); });
}

/** Whether the target of an event takes texts itself. @param {EventTarget | null} target */
function isField(target) {
  return target instanceof HTMLTextAreaElement || (target instanceof HTMLInputElement && target.type !== 'file');
}
