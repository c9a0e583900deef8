// Draws a mesh in place of the surface: its vertices have the colours of their distances, and two marks are
// at the largest distances.

import { curvatureColors } from './colors.js';
import { toScene } from './frame.js';
import { element } from './page.js';
import { PinView } from './pin-view.js';
import { buildMaterial } from './studio.js';
import { Box3, BufferAttribute, BufferGeometry, Group, Mesh, Vector3 } from './three.js';

/** @typedef {import('./check-request.js').Report} Report */
/** @typedef {import('./colors.js').Palette} Palette */
/** @typedef {import('./documents.js').Surface} Surface */

/** Half the width of what the view shows around a mark, as a share of the diagonal of the mesh. */
const NEAR = 0.1;

export class CheckView {
  /** @param {import('./view.js').View} view */
  constructor(view) {
    this.view = view;
    this.material = buildMaterial({ vertexColors: true, roughness: 0.6 });
    // The plane of a section cuts this material as it cuts those of surfaces.
    view.surfaceView.materials.set('check', this.material);
    this.mesh = new Mesh(new BufferGeometry(), this.material);
    this.mesh.castShadow = true;
    this.mesh.receiveShadow = true;
    /** Holds the edges of the mesh as it is, and its geometry. @type {any} */
    this.outline = new Group();
    this.mesh.add(this.outline);
    this.pins = [false, true].map((isLeft) => {
      const label = document.createElement('div');
      label.className = 'pin';
      label.hidden = true;
      label.setAttribute('aria-hidden', 'true');
      element('pin', HTMLElement).before(label);
      return new PinView(view.stage, label, isLeft);
    });
  }

  /**
   * @param {Surface} surface  in whose coordinates the mesh is @param {Report} report
   * @param {number} range  the largest distance of the scale of colours @param {number[][]} marks  places of the surface or of the mesh
   */
  show(surface, { mesh: { vertices, faces }, distances, middle_distances: middles }, range, marks) {
    this.forget();
    const { mesh, view } = this;
    // Coordinates far from the origin would lose digits as float32: the vertices are relative to the first one.
    const [origin = [0, 0, 0]] = vertices;
    const positions = new Float32Array(3 * vertices.length);
    vertices.forEach((vertex, i) => positions.set(toScene(surface, vertex.map((value, axis) => value - origin[axis])), 3 * i));
    const plain = new BufferGeometry();
    plain.setAttribute('position', new BufferAttribute(positions, 3));
    plain.setIndex(new BufferAttribute(Uint32Array.from(faces.flat()), 1));
    plain.computeVertexNormals();
    this.outline.geometry = plain;
    mesh.geometry = addMiddles(plain, faces);
    mesh.geometry.setAttribute('color', new BufferAttribute(curvatureColors([...distances, ...middles], range), 3));
    mesh.position.fromArray(toScene(surface, origin));
    this.material.clippingPlanes = view.surfaceView.clippingPlanes;
    view.stage.scene.add(mesh);
    mesh.updateMatrixWorld(true);
    const [radius, room] = [view.stage.radius(), view.stage.box.clone()];
    view.showCover(this);
    marks.forEach((point, i) => this.pins[i].show(toScene(surface, point), String(i + 1)));
    // A mesh elsewhere, or in other units, is out of sight.
    const isInSight = room.expandByScalar(0.2 * radius).containsBox(this.bounds());
    if (!isInSight || view.stage.radius() < 0.5 * radius) view.fit();
  }

  /** Gives the surface back. */
  hide() {
    this.forget();
    this.view.showCover(null);
  }

  /** Frees the memory of the mesh, and removes the marks. */
  forget() {
    const { mesh } = this;
    mesh.removeFromParent();
    mesh.geometry.dispose();
    const { userData } = this.outline;
    this.outline.clear();
    this.outline.geometry?.dispose();
    userData.wires?.geometry.dispose();
    userData.wires = undefined;
    this.pins.forEach((pin) => pin.hide());
  }

  /** Moves the camera to a mark. @param {number} index */
  lookAt(index) {
    const center = this.pins[index].group.position;
    const reach = NEAR * this.bounds().getSize(new Vector3()).length();
    const corners = [-reach, reach].flatMap((x) => [-reach, reach].map((y) => center.clone().add(new Vector3(x, y, 0))));
    this.view.stage.fit(corners, null);
  }

  bounds() {
    return new Box3().setFromObject(this.mesh, false);
  }

  /** The corners of the boxes of the mesh and of the surface. */
  corners() {
    const box = this.bounds().union(this.view.surfaceView.bounds());
    return [box.min.x, box.max.x].flatMap((x) => [box.min.y, box.max.y].flatMap((y) => (
      [box.min.z, box.max.z].map((z) => new Vector3(x, y, z))
    )));
  }

  /** @param {boolean} wires */
  showWires(wires) {
    this.view.surfaceView.showWires(this.outline, wires);
  }

  /** @param {Palette} palette */
  paint(palette) {
    this.pins.forEach((pin) => pin.paint(palette));
  }
}

/**
 * A mesh with a vertex more in the middle of each face, after the other vertices, so that it has a colour, too.
 * @param {BufferGeometry} plain @param {number[][]} faces
 */
function addMiddles(plain, faces) {
  const { count } = plain.getAttribute('position');
  const geometry = new BufferGeometry();
  ['position', 'normal'].forEach((name) => {
    const old = plain.getAttribute(name).array;
    const values = new Float32Array(3 * (count + faces.length));
    values.set(old);
    faces.forEach((face, i) => {
      for (let k = 0; k < 3; k += 1) values[3 * (count + i) + k] = face.reduce((sum, corner) => sum + old[3 * corner + k], 0) / 3;
    });
    geometry.setAttribute(name, new BufferAttribute(values, 3));
  });
  const index = new Uint32Array(9 * faces.length);
  faces.forEach(([a, b, c], i) => index.set([a, b, count + i, b, c, count + i, c, a, count + i], 9 * i));
  geometry.setIndex(new BufferAttribute(index, 1));
  return geometry;
}
