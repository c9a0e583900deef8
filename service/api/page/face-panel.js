// The lists of faces and edges: to choose one marks it, and says what it is. A click on a face chooses it, too.

import { listEdges } from './faces.js';
import { announce, element, makeElement } from './page.js';
import { sampleCurve } from './service.js';
import { perform } from './work.js';

/** @typedef {import('./faces.js').Edge} Edge */
/** @typedef {import('./faces.js').Face} Face */
/** @typedef {import('./state.js').State} State */

/**
 * @typedef {object} Callbacks
 * @property {(face: Face | null) => void} markFace
 * @property {(points: number[][]) => void} showEdge  draws this line of the document; without points none
 * @property {(error: Error) => void} failed
 */

export class FacePanel {
  /** @param {State} state @param {Callbacks} callbacks */
  constructor(state, callbacks) {
    this.state = state;
    this.callbacks = callbacks;
    /** @type {Face[]} */
    this.faces = [];
    /** @type {Edge[]} */
    this.edges = [];
    /** Aborts the request about an edge that is no longer chosen. */
    this.outdated = new AbortController();
    this.faceList = element('face', HTMLSelectElement);
    this.edgeList = element('edge', HTMLSelectElement);
    this.faceList.addEventListener('change', () => this.chooseFace(this.faceList.selectedIndex - 1));
    this.edgeList.addEventListener('change', () => {
      const number = this.edgeList.value;
      this.chooseEdge(number === '' ? null : this.edges[Number(number)]).catch(callbacks.failed);
    });
    state.listen((change) => {
      if (change === 'opened') this.showFaces([]);
    });
  }

  /** Lists the faces of the mesh that is shown. @param {Face[]} faces */
  showFaces(faces) {
    const isSame = faces.length === this.faces.length && faces.every(({ text }, i) => text === this.faces[i].text);
    this.faces = faces;
    element('faces', HTMLElement).hidden = faces.length < 2;
    if (isSame) {
      this.callbacks.markFace(faces[this.faceList.selectedIndex - 1] ?? null);
      return;
    }
    this.edges = listEdges(this.state.surface);
    element('h-faces', HTMLElement).textContent = this.edges.length > 0 ? 'Faces and edges' : 'Parts';
    element('face-label', HTMLElement).textContent = this.edges.length > 0 ? 'Face' : 'Part';
    this.faceList.replaceChildren(buildOption('', 'none'), ...faces.map(({ text }, i) => buildOption(String(i), text)));
    element('edge-row', HTMLElement).hidden = this.edges.length === 0;
    this.listEdges(-1);
    this.callbacks.markFace(null);
  }

  /** Chooses a face, and lists its edges. @param {number} index  in the list; -1 for none */
  chooseFace(index) {
    const face = this.faces[index] ?? null;
    this.faceList.selectedIndex = index + 1;
    this.callbacks.markFace(face);
    this.listEdges(face?.number ?? -1);
    if (face) announce(`${face.text} is chosen`);
  }

  /** Lists the edges of a face; all edges without one. @param {number} number */
  listEdges(number) {
    this.outdated.abort();
    const shown = this.edges.filter(({ faces }) => number < 0 || faces.includes(number));
    this.edgeList.replaceChildren(
      buildOption('', 'none'),
      ...shown.map((edge) => buildOption(String(edge.number), this.describe(edge, number))),
    );
    this.showEdge([], '');
  }

  /** An edge, and the faces on its other side. @param {Edge} edge @param {number} number  of the face that is chosen, or -1 */
  describe({ text, faces }, number) {
    const others = faces.filter((face) => face !== number);
    const names = others.map((other) => this.faces.find((face) => face.number === other)?.text ?? `face ${other}`);
    return names.length > 0 ? `${text}, ${number < 0 ? 'of' : 'to'} ${names.join(' and ')}` : text;
  }

  /** Draws an edge, and says how long it is. @param {Edge | null} edge */
  async chooseEdge(edge) {
    this.outdated.abort();
    this.outdated = new AbortController();
    this.showEdge([], '');
    if (edge === null) return;
    const { curve } = edge;
    if (curve === null) {
      this.showEdge([], `${this.describe(edge, -1)}: one point`);
      return;
    }
    const { points, length } = await perform(`Computing ${edge.text}`, (signal) => (
      sampleCurve(curve, signal)
    ), this.outdated.signal);
    this.showEdge(points, `${this.describe(edge, -1)}: length ${Number(length.toPrecision(6))}`);
  }

  /** @param {number[][]} points @param {string} text */
  showEdge(points, text) {
    this.callbacks.showEdge(points);
    element('edge-text', HTMLElement).textContent = text;
    if (text) announce(text);
  }
}

/** @param {string} value @param {string} text */
function buildOption(value, text) {
  const option = /** @type {HTMLOptionElement} */ (makeElement('option', text));
  option.value = value;
  return option;
}
