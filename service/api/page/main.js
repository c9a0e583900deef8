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
import { FacePanel } from './face-panel.js';
import { Measure } from './measure.js';
import { mesh } from './mesh.js';
import { watchNewPanel } from './new-panel.js';
import { announce, element, readTitle } from './page.js';
import { watchPanel } from './panel.js';
import { watchPointPanel } from './point-panel.js';
import { Probe } from './probe.js';
import { hideProblem, showProblem, watchProblems } from './problems.js';
import { clearReadouts, showReadouts, speakReadouts } from './readouts.js';
import { readReport } from './report.js';
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
  onBusy: (busy) => { if (busy === null && root.dataset.state === 'busy') root.dataset.state = 'ready'; },
});

/** @param {MeshResponse} response @param {boolean} coarse */
async function showMesh({ content, serverTime, roundTrip }, coarse) {
  const bytes = content.byteLength;
  const report = readReport(content);
  if (view) await view.showMesh(content, coarse);
  patchCount = report.patches;
  parts = report.parts ?? [];
  isShown = true;
  hideProblem();
  view?.markError(-1);
  // After a refusal too; when no request waits, it becomes `ready`.
  root.dataset.state = 'busy';
  showReadouts(report, { bytes, serverTime, roundTrip });
  if (coarse) return;
  speakReadouts(report);
  section.showMesh(report.bounds);
  if (view) facePanel.showFaces(view.listFaces(parts));
}

/** @param {boolean} coarse */
function requestMesh(coarse) {
  root.dataset.state = 'busy';
  requests.run({ coarse }).catch((error) => fail(error, true));
}

/** Shows an error of any work. @param {Error} error @param {boolean} isOfMesh */
function fail(error, isOfMesh = false) {
  if (error instanceof Outdated) return;
  if (error instanceof Stopped && !isOfMesh) {
    if (!requests.isBusy) root.dataset.state = isShown ? 'ready' : 'refused';
    showProblem(error, state);
    return;
  }
  if (isTooFine(error)) {
    state.set({ resolution: 1 });
    return;
  }
  const isExpected = [ServiceError, NoResponse, Stopped].some((kind) => error instanceof kind);
  root.dataset.state = error instanceof NoResponse ? 'away' : 'refused';
  if (!isShown) {
    view?.clear();
    clearReadouts();
  }
  const errorIndex = showProblem(error, state, isOfMesh);
  view?.markError(errorIndex);
  // An error of the page itself is also written to the console.
  if (!isExpected) reportError(error);
}

/** Whether the service refused the first mesh of a surface because of its resolution. @param {Error} error */
function isTooFine(error) {
  const { resolution, accuracy } = state.settings;
  return !isShown && error instanceof ServiceError && accuracy === 'resolution' && resolution > 1
    && error.errors.some(({ pointer, parameter }) => pointer === '/resolution' || parameter === 'resolution');
}

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
  }
  if (!isOpen || change === 'chosen' || (change === 'settings' && describeMesh() === requestedMesh)) return;
  requestedMesh = describeMesh();
  requestMesh(change === 'moving');
});

watchBusy(() => state.history.before !== null);
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
const library = new Library(() => { root.dataset.state = 'busy'; }, (surface, about) => {
  state.open(surface, about);
  announce(`${about.title} is open`);
}, fail);
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
watchProblems(state, requestAgain);
watchKey(requestAgain);
requestAgain();
