// Checks a mesh against the surface that is open: the service proves how far they are from each other, and the
// page shows the mesh in place of the surface, in the colours of the distances.

import { CheckPanel, describeInterval } from './check-panel.js';
import { requestCheck } from './check-request.js';
import { CheckView } from './check-view.js';
import { NotOpened } from './opening.js';
import { announce, element, readTitle } from './page.js';
import { Outdated, perform } from './work.js';

/** @typedef {import('./read-files.js').MeshFile} MeshFile */
/** @typedef {import('./check-request.js').Report} Report */
/** @typedef {import('./state.js').State} State */

/** What Escape closes before the check. */
const NEARER = 'dialog[open], #crosshair:not([hidden]), #views[open]';

export class Check {
  /**
   * @param {State} state @param {import('./view.js').View | null} view  null without WebGL
   * @param {(error: NotOpened, again: () => void) => void} failed
   */
  constructor(state, view, failed) {
    this.state = state;
    this.failed = failed;
    this.checkView = view && new CheckView(view);
    /** The mesh that is checked, or was. @type {MeshFile | null} */
    this.file = null;
    /** Whether the results are shown, and belong to the surface that is open. */
    this.isShown = false;
    /** Aborts the request about an older mesh, or an older surface. */
    this.outdated = new AbortController();
    this.panel = new CheckPanel({
      close: () => this.close(),
      again: () => { if (this.file) void this.start(this.file); },
      lookAt: this.checkView && ((index) => this.checkView?.lookAt(index)),
    });
    state.listen((change) => { if (change !== 'settings' && change !== 'chosen') this.outdate(); });
    addEventListener('keydown', (event) => {
      // The bar of work comes first, and says so by `preventDefault`.
      if (event.key !== 'Escape' || !this.isShown || event.defaultPrevented) return;
      if (event.target instanceof HTMLInputElement || document.querySelector(NEARER)) return;
      event.preventDefault();
      event.stopPropagation();
      this.close();
    }, { capture: true });
  }

  /** Checks a mesh in place of the one before. @param {MeshFile} file */
  async start(file) {
    this.outdated.abort();
    const outdated = new AbortController();
    this.outdated = outdated;
    const { surface, address } = this.state;
    const name = file.name || 'the mesh';
    try {
      const report = await perform(`Checking ${name} against ${readTitle()}`, (signal, tell) => (
        requestCheck(surface, address, file, signal, tell)), outdated.signal);
      this.file = file;
      this.show(name, report);
    } catch (error) {
      if (error instanceof Outdated) return;
      this.failed(new NotOpened(name, /** @type {Error} */ (error), 'checked'), () => void this.start(file));
    }
  }

  /** @param {string} name @param {Report} report */
  show(name, report) {
    const { surface_to_mesh: first, mesh_to_surface: second } = report;
    const range = second.high || 1;
    this.checkView?.show(this.state.surface, report, range, [first.point, second.point]);
    this.panel.show(name, report, range);
    this.isShown = true;
    announce(`${name} is checked. From the surface to the mesh: ${describeInterval(first.low, first.high)}. `
      + `From the mesh to the surface: ${describeInterval(second.low, second.high)}. Escape shows the surface again.`);
  }

  /** The surface has changed, or another one is open. */
  outdate() {
    this.outdated.abort();
    if (!this.isShown || !this.file) return;
    this.isShown = false;
    this.checkView?.hide();
    this.panel.showOutdated(this.file.name || 'the mesh');
    announce('The surface has changed since the mesh was checked');
  }

  close() {
    if (this.isShown) this.checkView?.hide();
    this.isShown = false;
    this.panel.hide();
    announce(`${element('title', HTMLElement).textContent} is shown again`);
  }
}
