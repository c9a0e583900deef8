// Draws the mesh of the surface, a GLB that three.js reads, in one of several looks.

import {
  Box3, BufferAttribute, BufferGeometry, DoubleSide, GLTFLoader, Group, LineBasicMaterial,
  LineSegments, MeshNormalMaterial, Vector3,
} from './three.js';
import { curvatureColors, findRange } from './colors.js';
import { decoder } from './decoder.js';
import { buildMaterial, OFFSET } from './studio.js';
import { buildZebra } from './zebra.js';

/** @typedef {import('./colors.js').Palette} Palette */
/** @typedef {import('./settings.js').Look} Look */
/** @typedef {import('./scene.js').Stage} Stage */

/** The names that the loader gives to the attributes of the service. */
const ATTRIBUTES = { gaussian: '_gaussian_curvature', mean: '_mean_curvature' };

const PLAIN = 'plain';

export class SurfaceView {
  /** @param {Stage} stage */
  constructor(stage) {
    this.stage = stage;
    this.loader = new GLTFLoader();
    this.model = new Group();
    /** @type {any[]} */
    this.meshes = [];
    /** Materials of the looks that show normals and curvatures. */
    this.normalMaterial = new MeshNormalMaterial({ side: DoubleSide, ...OFFSET });
    this.curvatureMaterial = buildMaterial({ vertexColors: true, roughness: 0.6 });
    this.zebraMaterial = buildZebra();
    /** Planes that hide what is on their other side. @type {import('./three.js').Plane[]} */
    this.clippingPlanes = [];
    /** Materials of the look `shaded` by name, also for later meshes, because to compile one takes time. */
    this.materials = new Map();
    this.wire = new LineBasicMaterial({ transparent: true, opacity: 0.32 });
    /** Whether meshes are drawn. */
    this.isVisible = true;
    /** The largest value of the range of colours of curvature, on both sides of zero. */
    this.range = 1;
    stage.scene.add(this.model);
  }

  /**
   * Shows a mesh in place of the present mesh, whose memory is freed.
   * @param {ArrayBuffer} content @param {() => void} [leave]  called before the present mesh is removed
   */
  async showMesh(content, leave) {
    this.loader.setMeshoptDecoder(await decoder);
    const gltf = await this.loader.parseAsync(content, '');
    leave?.();
    this.forget();
    this.model = gltf.scene;
    this.model.visible = this.isVisible;
    this.model.updateMatrixWorld(true);
    this.model.traverse((/** @type {any} */ node) => {
      if (node.isLine) node.material.clippingPlanes = this.clippingPlanes;
      if (!node.isMesh) return;
      node.castShadow = true;
      node.receiveShadow = true;
      node.userData.own = {
        material: this.findMaterial(node.material), color: node.geometry.getAttribute('color'),
      };
      this.meshes.push(node);
    });
    this.stage.scene.add(this.model);
  }

  /** The material of the page that replaces a material of a file. @param {any} original */
  findMaterial(original) {
    const { vertexColors, opacity, transparent } = original;
    // The service names a material `surface` if the document has no colour for its faces.
    const isPlain = original.name === 'surface' && !vertexColors;
    const name = isPlain ? PLAIN : `${original.color.getHexString()} ${opacity} ${vertexColors}`;
    if (!this.materials.has(name)) {
      const color = original.color.clone();
      const material = buildMaterial({ name, color, vertexColors, opacity, transparent });
      material.clippingPlanes = this.clippingPlanes;
      this.materials.set(name, material);
    }
    return this.materials.get(name);
  }

  /**
   * @param {Look} look @param {boolean} wires @param {Palette} palette
   * @param {boolean} coarse  whether the mesh follows the mouse: then the range of colours does not change
   */
  setLook(look, wires, palette, coarse) {
    this.wire.color.set(palette.wires);
    const attribute = look === 'gaussian' || look === 'mean' ? ATTRIBUTES[look] : null;
    if (attribute && !coarse) {
      this.range = findRange(this.meshes.map(({ geometry }) => ({
        values: geometry.getAttribute(attribute)?.array ?? [], areas: computeAreas(geometry),
      })));
    }
    this.meshes.forEach((mesh) => {
      const { own } = mesh.userData;
      const values = attribute && mesh.geometry.getAttribute(attribute);
      if (values) {
        const colors = curvatureColors(values.array, this.range);
        mesh.geometry.setAttribute('color', new BufferAttribute(colors, 3));
        mesh.material = this.curvatureMaterial;
      } else {
        if (own.color) mesh.geometry.setAttribute('color', own.color);
        const others = { normals: this.normalMaterial, zebra: this.zebraMaterial };
        mesh.material = others[/** @type {keyof typeof others} */ (look)] ?? own.material;
      }
      if (own.material.name === PLAIN) own.material.color.set(palette.glaze);
      this.showWires(mesh, wires);
    });
    this.stage.draw();
  }

  /** @param {boolean} isVisible */
  setVisible(isVisible) {
    this.isVisible = isVisible;
    this.model.visible = isVisible;
  }

  /** @param {number} stripes @param {number[]} axis  in the scene */
  setStripes(stripes, axis) {
    this.zebraMaterial.uniforms.stripes.value = stripes;
    this.zebraMaterial.uniforms.axis.value.fromArray(axis);
  }

  /** Hides what is on the other side of some planes. @param {import('./three.js').Plane[]} planes */
  clip(planes) {
    this.clippingPlanes = planes;
    const materials = [
      this.normalMaterial, this.curvatureMaterial, this.zebraMaterial, this.wire, ...this.materials.values(),
    ];
    materials.forEach((material) => { material.clippingPlanes = planes; });
    this.model.traverse((/** @type {any} */ node) => { if (node.isLine) node.material.clippingPlanes = planes; });
    this.stage.draw();
  }

  /** Whether a point of the scene is on the sides that are shown. @param {Vector3} point */
  isShown(point) {
    return this.clippingPlanes.every((plane) => plane.distanceToPoint(point) >= 0);
  }

  /** @param {any} mesh @param {boolean} wires */
  showWires(mesh, wires) {
    const lines = mesh.userData.wires;
    if (lines) lines.visible = wires;
    if (lines || !wires) return;
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', mesh.geometry.getAttribute('position'));
    geometry.setIndex(new BufferAttribute(findEdges(mesh.geometry.index.array), 1));
    mesh.userData.wires = new LineSegments(geometry, this.wire);
    mesh.add(mesh.userData.wires);
  }

  /** Whether the mesh has curvatures. */
  get hasCurvatures() {
    return this.meshes.some((mesh) => mesh.geometry.getAttribute(ATTRIBUTES.mean));
  }

  bounds() {
    return new Box3().setFromObject(this.model, false);
  }

  /** The positions of all vertices. */
  points() {
    return this.meshes.flatMap((mesh) => {
      const position = mesh.geometry.getAttribute('position');
      return Array.from({ length: position.count }, (_, i) => (
        new Vector3().fromBufferAttribute(position, i).applyMatrix4(mesh.matrixWorld)
      ));
    });
  }

  forget() {
    this.stage.scene.remove(this.model);
    this.meshes.forEach((mesh) => {
      mesh.geometry.dispose();
      mesh.userData.wires?.geometry.dispose();
    });
    this.meshes = [];
  }
}

/** For each vertex, twice the area of its triangles, as a weight. @param {any} geometry */
function computeAreas(geometry) {
  const position = geometry.getAttribute('position');
  const areas = new Float32Array(position.count);
  const triangles = geometry.index.array;
  const [a, b, c] = [new Vector3(), new Vector3(), new Vector3()];
  for (let i = 0; i < triangles.length; i += 3) {
    const corners = [triangles[i], triangles[i + 1], triangles[i + 2]];
    [a, b, c].forEach((corner, k) => corner.fromBufferAttribute(position, corners[k]));
    const area = b.sub(a).cross(c.sub(a)).length();
    corners.forEach((corner) => { areas[corner] += area; });
  }
  return areas;
}

/** The edges of triangles, each once, as pairs of vertices in one array. @param {ArrayLike<number>} triangles */
function findEdges(triangles) {
  let vertexCount = 0;
  for (let i = 0; i < triangles.length; i += 1) vertexCount = Math.max(vertexCount, triangles[i] + 1);
  const edges = new Set();
  for (let i = 0; i < triangles.length; i += 3) {
    for (let k = 0; k < 3; k += 1) {
      const [a, b] = [triangles[i + k], triangles[i + ((k + 1) % 3)]];
      edges.add(Math.min(a, b) * vertexCount + Math.max(a, b)); // one number for each pair
    }
  }
  const pairs = new Uint32Array(2 * edges.size);
  let offset = 0;
  edges.forEach((edge) => {
    pairs[offset] = Math.floor(edge / vertexCount);
    pairs[offset + 1] = edge % vertexCount;
    offset += 2;
  });
  return pairs;
}
