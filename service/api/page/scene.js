// The stage: camera, light and floor. It draws a picture only after a change.

import { buildFloor } from './floor.js';
import {
  Box3, DirectionalLight, HemisphereLight, MathUtils, NeutralToneMapping, OrbitControls,
  OrthographicCamera, PerspectiveCamera, Scene, Vector3, VSMShadowMap, WebGLRenderer,
} from './three.js';

/** @typedef {import('./colors.js').Palette} Palette */

/** Vertical, in degrees. */
const FIELD_OF_VIEW = 26;
/** From the target to the camera, for a new surface: from slightly above. */
export const DEFAULT_DIRECTION = new Vector3(0.42, 0.4, 1).normalize();
/** Half the height of the view, divided by the distance of what it shows. */
const SLOPE = Math.tan(MathUtils.degToRad(FIELD_OF_VIEW) / 2);
/** The width of the view, divided by the width of the model in it. */
const MARGIN = 1.09;

/** The WebGL 2 context of a canvas, or null without WebGL 2. @param {HTMLCanvasElement} canvas */
export function createContext(canvas) {
  return canvas.getContext('webgl2', { antialias: true, alpha: true, powerPreference: 'default' });
}

export class Stage {
  /** @param {HTMLCanvasElement} canvas @param {WebGL2RenderingContext} context */
  constructor(canvas, context) {
    this.canvas = canvas;
    this.scene = new Scene();
    /** The camera that the controls move. */
    this.camera = new PerspectiveCamera(FIELD_OF_VIEW);
    /** A camera without perspective in the same place, which shows as much of the target. */
    this.orthographicCamera = new OrthographicCamera();
    this.isOrthographic = false;
    this.renderer = new WebGLRenderer({ canvas, context, antialias: true, alpha: true });
    this.renderer.toneMapping = NeutralToneMapping;
    this.renderer.localClippingEnabled = true;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = VSMShadowMap;
    // Shadows are drawn again for a new mesh, not when the camera turns.
    this.renderer.shadowMap.autoUpdate = false;
    /** The width of the canvas in device pixels, for shaders. */
    this.width = { value: 1 };
    // The main light, and a weaker light from behind.
    this.key = new DirectionalLight('#fff4e3', 2.3);
    this.rim = new DirectionalLight('#dfe9ff', 0.7);
    this.floor = buildFloor(this.width);
    this.addLightAndFloor();
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = !matchMedia('(prefers-reduced-motion: reduce)').matches;
    this.controls.dampingFactor = 0.14;
    this.controls.addEventListener('change', () => this.draw());
    this.box = new Box3(new Vector3(-1, -1, -1), new Vector3(1, 1, 1));
    this.isDrawPending = false;
    /** Whether a mesh was shown. Before, nothing is drawn: compiling the shaders would delay the page. */
    this.isStarted = false;
    /** @type {(() => void)[]} */
    this.beforeDraw = [];
    /** @type {(() => void)[]} */
    this.onDraw = [];
    new ResizeObserver(() => this.resize()).observe(canvas);
  }

  addLightAndFloor() {
    const { key, rim, floor } = this;
    key.castShadow = true;
    key.shadow.mapSize.set(512, 512);
    key.shadow.radius = 5;
    key.shadow.blurSamples = 12;
    const ambient = new HemisphereLight('#eaf1fb', '#b9a58d', 1.6);
    this.scene.add(ambient, key, key.target, rim, rim.target, floor);
  }

  /** Draws with the next frame: once, even after several calls. */
  draw() {
    if (this.isDrawPending || !this.isStarted) return;
    this.isDrawPending = true;
    requestAnimationFrame(() => this.drawNow());
  }

  drawNow() {
    this.isDrawPending = false;
    this.controls.update();
    this.copyCamera();
    this.beforeDraw.forEach((listener) => listener());
    this.renderer.render(this.scene, this.drawingCamera);
    this.onDraw.forEach((listener) => listener());
  }

  /** The camera that draws, and by which places of the canvas are found in the scene. */
  get drawingCamera() {
    return this.isOrthographic ? this.orthographicCamera : this.camera;
  }

  /** Draws without perspective, or with it. @param {boolean} isOrthographic */
  setOrthographic(isOrthographic) {
    this.isOrthographic = isOrthographic;
    this.copyCamera();
    this.draw();
  }

  /** Places the camera without perspective as the other one. */
  copyCamera() {
    const { camera, orthographicCamera: copy, controls } = this;
    camera.updateMatrixWorld();
    copy.position.copy(camera.position);
    copy.quaternion.copy(camera.quaternion);
    const top = SLOPE * camera.position.distanceTo(controls.target);
    const right = top * camera.aspect;
    // What is beside or behind the camera is drawn, too: without perspective, its place has no meaning.
    Object.assign(copy, { left: -right, right, top, bottom: -top, near: -camera.far, far: camera.far });
    copy.updateProjectionMatrix();
    copy.updateMatrixWorld();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.width.value = this.canvas.width;
    this.camera.aspect = width / height;
    [this.camera, this.orthographicCamera].forEach((camera) => (
      camera.setViewOffset(width, height, 0, this.coveredHeight() / 2, width, height)
    ));
    // A canvas of a new size is empty, so it is drawn at once.
    if (this.isStarted) this.drawNow();
  }

  /** The height, at the bottom of the canvas, that other elements cover; the scene is centred above it. */
  coveredHeight() {
    const cover = document.querySelector('[data-covers-view]');
    if (!cover || getComputedStyle(cover).position !== 'absolute') return 0;
    return this.canvas.getBoundingClientRect().bottom - cover.getBoundingClientRect().top;
  }

  /** Places light, shadow and floor for a model with this box. @param {Box3} box */
  placeLights(box) {
    this.isStarted = true;
    this.box = box;
    const radius = this.radius();
    const center = box.getCenter(new Vector3());
    const place = (/** @type {DirectionalLight} */ light, /** @type {Vector3} */ direction) => {
      light.position.copy(center).addScaledVector(direction, 2 * radius);
      light.target.position.copy(center);
      light.target.updateMatrixWorld();
    };
    place(this.key, new Vector3(-0.9, 1.7, 1.1));
    place(this.rim, new Vector3(1.6, 0.9, -1.8));
    this.key.shadow.normalBias = 0.03 * radius;
    Object.assign(this.key.shadow.camera, {
      left: -1.6 * radius, right: 1.6 * radius, top: 1.6 * radius, bottom: -1.6 * radius,
      near: 0.1 * radius, far: 8 * radius,
    });
    this.key.shadow.camera.updateProjectionMatrix();
    this.floor.position.set(center.x, box.min.y - 0.004 * radius, center.z);
    this.floor.scale.setScalar(40 * radius);
    this.renderer.shadowMap.needsUpdate = true;
    this.draw();
  }

  radius() {
    return Math.max(1e-6, this.box.getSize(new Vector3()).length() / 2);
  }

  /**
   * Moves the camera to the nearest position from which it shows all points, and looks at their middle.
   * @param {Vector3[]} points  are overwritten
   * @param {Vector3 | null} towardsCamera  from where it looks; null: from where it is
   */
  fit(points, towardsCamera) {
    const { camera, controls } = this;
    const box = new Box3().setFromPoints(points);
    const radius = Math.max(1e-6, box.getSize(new Vector3()).length() / 2);
    const center = box.getCenter(new Vector3());
    const direction = towardsCamera?.clone().normalize()
      ?? camera.position.clone().sub(controls.target).normalize();
    camera.position.copy(center).add(direction);
    camera.lookAt(center);
    camera.updateMatrixWorld();
    const toCamera = camera.quaternion.clone().invert();
    // Slopes of the sides of the visible pyramid, for the part of the canvas that is not covered.
    const { clientHeight: height } = this.canvas;
    const slopeX = camera.aspect * SLOPE;
    const slopeY = SLOPE * (1 - this.coveredHeight() / height);
    const distance = points.reduce((maximum, point) => {
      const { x, y, z } = point.sub(center).applyQuaternion(toCamera);
      const depth = this.isOrthographic ? 0 : z;
      return Math.max(maximum, depth + MARGIN * Math.max(Math.abs(x) / slopeX, Math.abs(y) / slopeY));
    }, 0.2 * radius);
    camera.position.copy(center).addScaledVector(direction, distance);
    camera.near = 0.02 * radius;
    camera.far = 80 * radius;
    camera.updateProjectionMatrix();
    controls.target.copy(center);
    Object.assign(controls, { minDistance: 0.1 * radius, maxDistance: 30 * radius });
    this.draw();
  }

  /** The position of the camera, and of the point it looks at: six numbers. */
  readCamera() {
    return [...this.camera.position.toArray(), ...this.controls.target.toArray()];
  }

  /** @param {number[]} numbers  as of `readCamera` */
  placeCamera(numbers) {
    this.camera.position.fromArray(numbers);
    this.controls.target.fromArray(numbers, 3);
    this.draw();
  }

  /** Turns the camera about its target. @param {number} right @param {number} up  radians */
  turn(right, up) {
    const offset = this.camera.position.clone().sub(this.controls.target);
    const distance = offset.length();
    const azimuth = Math.atan2(offset.x, offset.z) + right;
    // At ±π/2, directly above or below the target, the camera would lose its upright direction.
    const elevation = Math.min(1.5, Math.max(-1.5, Math.asin(offset.y / distance) + up));
    offset.set(Math.sin(azimuth) * Math.cos(elevation), Math.sin(elevation),
      Math.cos(azimuth) * Math.cos(elevation)).multiplyScalar(distance);
    this.camera.position.copy(this.controls.target).add(offset);
    this.draw();
  }

  /** Moves the camera nearer or further away. @param {number} factor  of the distance */
  zoom(factor) {
    const offset = this.camera.position.clone().sub(this.controls.target).multiplyScalar(factor);
    this.camera.position.copy(this.controls.target).add(offset);
    this.draw();
  }

  /** @param {Palette} palette */
  paint(palette) {
    this.floor.material.opacity = palette.shadow;
    this.draw();
  }
}
