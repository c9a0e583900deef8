// Draws the state: surface, net, marker, legend. Without WebGL it draws nothing, and the rest of the
// page still works.

import { formatCamera } from './address.js';
import { PALETTES } from './colors.js';
import { AxesView } from './axes-view.js';
import { watchCrosshair } from './crosshair.js';
import { FaceView } from './face-view.js';
import { findFace, listFaces, nameOf } from './faces.js';
import { toDocument, toScene } from './frame.js';
import { Raycaster, Vector3 } from './three.js';
import { paintLegend, showLegend } from './legend.js';
import { NetView } from './net-view.js';
import { button, checkRadio, getChecked, element, write } from './page.js';
import { PinView } from './pin-view.js';
import { PlaneView } from './plane-view.js';
import { placeMarker } from './point-marker.js';
import { Gizmo } from './gizmo.js';
import { watchPointer } from './pointer.js';
import { DEFAULT_DIRECTION, Stage } from './scene.js';
import { SectionView } from './section-view.js';
import { chooseLook, hasPart, hasSweep } from './settings.js';
import { SurfaceView } from './surface-view.js';
import { theme } from './theme.js';

/** @typedef {import('./moves.js').Axis} Axis */
/** @typedef {import('./state.js').State} State */

/** The width of an edge that is chosen, in CSS pixels. */
const EDGE_WIDTH = 4;
/** The most triangles of a mesh whose faces are marked under the mouse: each move searches all of them. */
const MAX_HOVER_TRIANGLES = 150_000;

/** @param {string} id @param {boolean} isHidden */
const hide = (id, isHidden) => { element(id, HTMLElement).hidden = isHidden; };

export class View {
  /** @param {State} state @param {WebGL2RenderingContext} context */
  constructor(state, context) {
    this.state = state;
    this.stage = new Stage(element('view', HTMLCanvasElement), context);
    this.surfaceView = new SurfaceView(this.stage);
    this.netView = new NetView(this.stage);
    this.sectionView = new SectionView(this.stage);
    this.edgeView = new SectionView(this.stage, 'chosen', EDGE_WIDTH);
    this.pinView = new PinView(this.stage);
    this.faceView = new FaceView(this.stage);
    /** The faces of the mesh that is shown. @type {import('./faces.js').Face[]} */
    this.faces = [];
    this.planeView = new PlaneView(this.stage);
    new AxesView(this.stage, state, (towardsCamera) => this.fit(towardsCamera));
    /** Whether the open document has not been shown yet. */
    this.isNew = true;
    /** The camera for the document that is shown next, if not the default one. @type {number[] | null} */
    this.nextCamera = null;
    /** The camera that the document got by default. @type {number[]} */
    this.defaultCamera = [];
    /** What is drawn in place of the surface and its net. @type {import('./check-view.js').CheckView | null} */
    this.cover = null;
    /** Number of the control point that an error names, or -1. */
    this.errorIndex = -1;
    new Gizmo(this.stage, this.netView, state);
    const fit = () => this.fit();
    watchPointer(this.stage, this.netView, state, {
      axis: () => /** @type {Axis} */ (getChecked('axis')),
      choosesSeveral: () => button('choose-several').getAttribute('aria-pressed') === 'true',
      setAxis: (axis) => checkRadio('axis', axis),
      fit,
      click: (mouse) => this.click(mouse),
    });
    watchCrosshair(this.stage.canvas, (mouse, x, y) => {
      const index = this.netView.pick(x, y, 'mouse');
      if (index >= 0) state.choose(index);
      else this.click(mouse);
    });
    this.faceView.watch((mouse) => this.findHovered(mouse));
    /** Called with what the user clicked. @type {(hit: import('./probe.js').Hit) => void} */
    this.clicked = () => {};
    element('fit', HTMLButtonElement).addEventListener('click', fit);
    this.stage.onDraw.push(() => { placeMarker(state.chosen, this.netView); hide('loading', true); });
    paintLegend(element('legend-bar', HTMLCanvasElement));
    state.listen((change) => {
      if (change === 'opened') this.isNew = true;
      if (change !== 'settings') this.showNet();
      else this.updateLook();
    });
  }

  /** Shows a mesh that the service made. @param {ArrayBuffer} content @param {boolean} coarse  whether the mesh follows the mouse */
  async showMesh(content, coarse) {
    await this.surfaceView.showMesh(content, () => this.faceView.forget());
    this.updateLook(coarse);
    if (!coarse) this.stage.placeLights(this.surfaceView.bounds());
    if (this.isNew) this.placeFirst();
    this.isNew = false;
    this.paint();
  }

  /** Places the camera for a document that has not been shown yet. */
  placeFirst() {
    this.fit(DEFAULT_DIRECTION);
    this.defaultCamera = this.stage.readCamera();
    if (this.nextCamera) this.stage.placeCamera(this.nextCamera);
  }

  /** The camera: its position and target; null for the default one. */
  readCamera() {
    if (this.isNew) return this.nextCamera;
    const camera = this.stage.readCamera();
    return formatCamera(camera) === formatCamera(this.defaultCamera) ? null : camera;
  }

  /** Uses a camera for the document that is shown next, or is shown now; null for the default one. @param {number[] | null} camera */
  startCamera(camera) {
    this.nextCamera = camera;
    if (!this.isNew) this.stage.placeCamera(camera ?? this.defaultCamera);
  }

  /** Lists the faces of the mesh that is shown. @param {{name: string}[]} parts  of the report */
  listFaces(parts) {
    this.faces = listFaces(this.surfaceView.meshes, parts, this.state.surface.type === 'brep');
    return this.faces;
  }

  /** Handles a click that hits no control point. @param {import('./three.js').Vector2} mouse */
  click(mouse) {
    const hit = this.findHit(mouse);
    if (!hit) return;
    const name = this.surfaceView.meshes.length > 1 ? nameOf(hit.object) : '';
    const point = toDocument(this.state.surface, hit.point.toArray());
    this.clicked({ point, name, face: hasPart(this.state.surface) ? findFace(this.faces, hit) : -1 });
  }

  /** The nearest place of the mesh under the mouse that is shown. @param {import('./three.js').Vector2} mouse */
  findHit(mouse) {
    if (this.cover) return undefined;
    const caster = new Raycaster();
    caster.setFromCamera(mouse, this.stage.drawingCamera);
    const hits = caster.intersectObjects(this.surfaceView.meshes, false);
    return hits.find(({ point }) => this.surfaceView.isShown(point));
  }

  /** The face of a part under the mouse, if it is to be marked. @param {import('./three.js').Vector2} mouse */
  findHovered(mouse) {
    const count = this.faces.reduce((sum, { first, end }) => sum + end - first, 0);
    if (this.faces.length < 2 || count > MAX_HOVER_TRIANGLES || !hasPart(this.state.surface)) return null;
    const hit = this.findHit(mouse);
    return hit ? this.faces[findFace(this.faces, hit)] ?? null : null;
  }

  /** Draws an edge in place of the present one. @param {number[][]} points  of the document; none draws no edge */
  showEdge(points) {
    this.edgeView.show(points.length > 0 ? [points.map((point) => toScene(this.state.surface, point))] : []);
  }

  /** Draws the plane of a section, and hides the side that is not shown. @param {import('./section-plane.js').SectionPlane | null} plane */
  showPlane(plane) {
    const planes = this.planeView.show(plane, this.state.surface, this.surfaceView.bounds());
    this.surfaceView.clip(planes);
    this.faceView.materials.forEach((material) => { material.clippingPlanes = planes; });
  }

  /** The direction towards the camera, in the document. */
  facing() {
    const direction = this.stage.camera.getWorldDirection(new Vector3()).negate();
    return toDocument({ up: this.state.surface.up }, direction.toArray());
  }

  /** Marks a point of the document, with a text beside it. @param {number[]} point @param {string} text */
  showPin(point, text) {
    this.pinView.show(toScene(this.state.surface, point), text);
  }

  /** Draws the lines of a section of the document, in place of the present ones. @param {{points: number[][]}[]} polylines */
  showSection(polylines) {
    this.sectionView.show(polylines.map(({ points }) => points.map((point) => toScene(this.state.surface, point))));
  }

  /** Draws something in place of the surface and its net; null: the surface again. @param {import('./check-view.js').CheckView | null} cover */
  showCover(cover) {
    this.cover = cover;
    this.surfaceView.setVisible(cover === null);
    this.updateLook();
    this.stage.placeLights(cover?.bounds() ?? this.surfaceView.bounds());
  }

  /** Removes the mesh: it belongs to a document that is no longer open. */
  clear() {
    this.faceView.forget();
    this.faces = [];
    this.surfaceView.forget();
    // Draws the shadow again, now without the mesh; the lights stay where they were.
    this.stage.placeLights(this.stage.box);
  }

  /** Shows the net of the document, and the chosen point. */
  showNet() {
    const { state } = this;
    this.netView.showNet(state.net, state.surface);
    // The control points of a tube are inside it, so its net is drawn strongly through the surface.
    this.netView.setVisible(hasSweep(state.surface));
    this.netView.highlight(state.selection, -1);
    this.paint();
  }

  /** Marks the control point that an error names; -1 marks none. @param {number} index */
  markError(index) {
    this.errorIndex = index;
    this.paint();
  }

  /** @param {boolean} coarse */
  updateLook(coarse = false) {
    const { settings } = this.state;
    this.netView.group.visible = settings.net && !this.cover;
    const { surface } = this.state;
    const look = chooseLook(settings, surface);
    const axis = ['x', 'y', 'z'].map((name) => Number(name === settings.stripeAxis));
    this.surfaceView.setStripes(settings.stripes, toScene({ up: surface.up }, axis));
    this.surfaceView.setLook(look, settings.wires, PALETTES[theme()], coarse);
    this.paint();
    this.cover?.showWires(settings.wires);
    showLegend(this.cover ? '' : look, this.surfaceView);
  }

  paint() {
    const palette = PALETTES[theme()];
    const { chosen, history, net } = this.state;
    write('net-color', palette.name);
    // The invitation to move a point is hidden after the first move.
    hide('invitation', this.isNew || history.canUndo || !this.netView.group.visible || net.handles.length === 0);
    this.netView.paint(palette, chosen >= 0 && chosen === this.errorIndex);
    this.sectionView.paint(palette);
    this.edgeView.paint(palette);
    this.pinView.paint(palette);
    this.cover?.paint(palette);
    this.planeView.paint(palette);
    this.stage.paint(palette);
  }

  /**
   * Shows the whole surface.
   * @param {import('./three.js').Vector3 | null} towardsCamera  from where, in the scene; null: from where it is seen now
   */
  fit(towardsCamera = null) {
    const points = this.cover?.corners() ?? [...this.surfaceView.points(), ...this.netView.visiblePoints()];
    if (points.length > 0) this.stage.fit(points, towardsCamera);
  }
}
