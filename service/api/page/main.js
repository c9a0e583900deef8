// The editor: opens a surface, requests its mesh after each change, and shows it.

import { NewestOnly, NoResponse, ServiceError } from 'surface-service';
import { readAddress } from './address.js';
import { watchBusy } from './busy.js';
import { compression } from './decoder.js';
import { Drafts } from './drafts.js';
import { hasKey, keepsAll, watchDraftList } from './draft-list.js';
import { watchEditPanel } from './edit-panel.js';
import { watchKey } from './key.js';
import { Library, showAbout } from './library.js';
import { loadLater } from './load-later.js';
import { FacePanel } from './face-panel.js';
import { Measure } from './measure.js';
import { mesh } from './mesh.js';
import { watchNewPanel } from './new-panel.js';
import { Opening } from './opening.js';
import { announce, element, readTitle } from './page.js';
import { isServiceAway } from './presence.js';
import { watchPanel } from './panel.js';
import { watchPointPanel } from './point-panel.js';
import { Probe } from './probe.js';
import { hideProblem, showProblem, watchProblems } from './problems.js';
import { clearReadouts, showReadouts, speakReadouts } from './readouts.js';
import { readReport } from './report.js';
import { Unreadable } from './unreadable.js';
import { createContext } from './scene.js';
import { Section } from './section.js';
import { describeAccuracy, meshOptions } from './settings.js';
import { watchShare } from './share.js';
import { State } from './state.js';
import { Tab } from './tab.js';
import { watchTheme } from './theme.js';
import { View } from './view.js';
import { watchViews } from './views.js';
import { Visits } from './visits.js';
import { Outdated, perform, Stopped } from './work.js';

/** @typedef {import('./mesh.js').MeshResponse} MeshResponse */

const FIRST_SURFACE = 'utah-teapot';

const root = document.documentElement;
const state = new State(readAddress(location).settings);
const context = createContext(element('view', HTMLCanvasElement));
const view = context ? new View(state, context) : null;
element('no-webgl', HTMLElement).hidden = view !== null;
element('loading', HTMLElement).hidden = view === null;

/** A request for a mesh; a coarse mesh follows the mouse. @typedef {{coarse: boolean}} MeshRequest */

/** The number of patches of the surface, on which the resolution of a coarse mesh depends. */
let patchCount = 1;
/** The parts in the report of the mesh: of a brep, its faces. @type {{name: string, deviation_bound?: number}[]} */
let parts = [];
/** How the last request for a mesh of the open document ended. @type {'ready' | 'refused' | 'away'} */
let outcome = 'refused';
/** Whether the document that is open has a mesh. */
let isShown = false;
/** Whether any document is open. */
let isOpen = false;

/** The longest time, in milliseconds, for which a coarse mesh is computed if a newer one is needed. */
const COARSE_PATIENCE = 5000;

/** @type {NewestOnly<MeshRequest, void>} */
const requests = new NewestOnly(async ({ coarse }, outdated) => {
  const options = meshOptions(state.settings, state.surface, patchCount, coarse);
  const request = { surface: state.surface, ...options };
  // The first mesh comes by its address, so that the browser keeps it, and edited ones by a POST.
  const address = isShown ? '' : state.address;
  const what = `Computing the mesh of ${readTitle()} ${describeAccuracy(state.settings, state.surface)}`;
  try {
    const response = await perform(what, async (signal, tell) => (
      mesh({ ...request, ...await compression() }, { address, signal, tell })), outdated);
    if (!outdated.aborted) await showMesh(response, coarse);
  } catch (error) {
    // A user who stops a mesh wants no newer one.
    if (error instanceof Stopped) requests.drop();
    throw error;
  }
}, {
  keep: ({ coarse }, milliseconds) => coarse && milliseconds < COARSE_PATIENCE,
  onBusy: (busy) => { if (busy === null) settle(); },
});

/** Shows a mesh of the open document. @param {MeshResponse} response @param {boolean} coarse */
async function showMesh({ content, serverTime, roundTrip }, coarse) {
  const bytes = content.byteLength;
  const report = readReport(content);
  if (view) await view.showMesh(content, coarse);
  patchCount = report.patches;
  parts = report.parts ?? [];
  isShown = true;
  hideProblem();
  view?.markError(-1);
  outcome = 'ready';
  showReadouts(report, { bytes, serverTime, roundTrip });
  if (coarse) return;
  speakReadouts(report);
  section.showMesh(report.bounds);
  if (view) facePanel.showFaces(view.listFaces(parts));
}

/** @param {boolean} coarse */
function requestMesh(coarse) {
  showWaiting();
  requests.run({ coarse }).catch((error) => fail(error, () => requestMesh(false)));
}

/** Says in `html[data-state]` that the page waits for a mesh, or for a surface. */
function showWaiting() {
  root.dataset.state = isServiceAway() ? 'away' : 'busy';
}

/** Says in `html[data-state]` how the last request for a mesh ended, if no other one runs. */
function settle() {
  if (!requests.isBusy && !opening.isRunning) root.dataset.state = outcome;
}

/** Shows an error of any work. @param {Error} error @param {(() => void) | null} retry  asks for a mesh again */
function fail(error, retry = null) {
  if (error instanceof Outdated) return;
  if (error instanceof Stopped && retry === null) {
    showProblem(error, state);
    return;
  }
  outcome = error instanceof NoResponse ? 'away' : 'refused';
  settle();
  if (!isShown) {
    view?.clear();
    clearReadouts();
  }
  const errorIndex = showProblem(error, state, retry);
  view?.markError(errorIndex);
  // An error of the page itself is also written to the console.
  if (!isExpected(error)) reportError(error);
}

/** Whether an error is no mistake of the page. @param {Error} error */
function isExpected(error) {
  return [ServiceError, NoResponse, Stopped, Unreadable].some((kind) => error instanceof kind);
}

/** The first mesh of the surface that is being opened. @type {import('./opening.js').First | null} */
let first = null;
/** The settings on which the mesh depends, as a text; 1: only coarse meshes need the number of patches. */
const describeMesh = () => JSON.stringify(meshOptions(state.settings, state.surface, 1, false));
let requestedMesh = '';

state.listen((change) => {
  if (change === 'opened') {
    isOpen = true;
    showAbout(state.about);
    requests.abort();
    hideProblem();
    isShown = false;
    patchCount = 1;
    if (first !== null) {
      requestedMesh = describeMesh();
      // After the other listeners, some of which forget the section and the measures of the document before.
      void Promise.resolve(first.response).then((response) => showMesh(response, false)).then(settle);
      return;
    }
    opening.cancel();
  }
  if (!isOpen || change === 'chosen' || (change === 'settings' && describeMesh() === requestedMesh)) return;
  requestedMesh = describeMesh();
  requestMesh(change === 'moving');
});

// Drags and keys that move points have the focus in the view; while a number is typed, Escape stops work.
watchBusy(() => state.history.before !== null && document.activeElement?.id === 'view');
watchTheme(() => view?.updateLook());
const probe = new Probe(state, {
  show: (point, text) => view?.showPin(point, text),
  hide: () => view?.pinView.hide(),
});
const measures = new Measure(state);
const facePanel = new FacePanel(state, {
  markFace: (face) => view?.faceView.choose(face),
  showEdge: (points) => view?.showEdge(points),
  failed: (error) => fail(error),
});
const section = new Section(state, {
  show: (polylines) => view?.showSection(polylines),
  showPlane: (plane) => view?.showPlane(plane),
  facing: () => view?.facing() ?? null,
  place: () => probe.point,
  failed: (error) => showProblem(error, state),
  mended: () => { if (root.dataset.state !== 'refused' && root.dataset.state !== 'away') hideProblem(); },
});
element('measure', HTMLButtonElement).addEventListener('click', () => { measures.ask().catch((error) => fail(error)); });
if (view) {
  watchViews(state, view);
  view.planeView.moved = (distance) => section.moveBy(distance);
  view.clicked = (hit) => {
    if (hit.face >= 0) facePanel.chooseFace(hit.face);
    probe.showPoint(hit, state.surface.type === 'brep' ? parts : []).catch((error) => fail(error));
  };
}
watchPanel(state);
watchPointPanel(state);
watchEditPanel(state, (error) => fail(error));
const opening = new Opening(state, {
  waiting: showWaiting,
  settle,
  open: (surface, about, firstMesh) => {
    first = firstMesh;
    const { accuracy, resolution, tolerance } = first.settings;
    state.open(surface, about, { settings: { ...state.settings, accuracy, resolution, tolerance } });
    first = null;
    announce(`${about.title} is open`);
  },
  failed: (error, again) => {
    if (!isOpen && error.reason instanceof NoResponse) outcome = 'away';
    if (!isOpen) view?.clear();
    settle();
    showProblem(error, state, again);
    if (!isExpected(error.reason)) reportError(error.reason);
  },
});
/** Checks meshes; the first one loads its module. @type {import('./check.js').Check | null} */
let check = null;
const library = new Library(opening, async (mesh) => {
  if (!isOpen) return false;
  const { Check } = await loadLater();
  check ??= new Check(state, view, (error, again) => showProblem(error, state, again));
  void check.start(mesh);
  return true;
});
watchNewPanel((surface, about) => library.show(surface, about));

const visits = new Visits(state, new Drafts(new Tab(), hasKey, keepsAll), {
  read: () => view?.readCamera() ?? null,
  start: (camera) => view?.startCamera(camera),
}, (id) => library.openById(id));
view?.stage.onDraw.push(() => visits.noteAddress());
watchDraftList(visits.drafts, visits);

// An error of an export does not change the state of the surface on the page.
watchShare(state, (id) => visits.describeAddress(id), (error) => showProblem(error, state));
/** Requests the mesh of the open document, or opens the first one: at the start, after a failure, with a new key. */
const requestAgain = () => (isOpen ? requestMesh(false) : void visits.start(FIRST_SURFACE));
watchProblems(state);
watchKey(requestAgain);
requestAgain();
