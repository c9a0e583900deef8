// The view at `/embed?src=<path of a mesh>`, for frames of other pages: it shows a mesh, and changes nothing.

import { PALETTES } from './colors.js';
import { resolveMesh } from './mesh-path.js';
import { button, element, write } from './page.js';
import { createContext, DEFAULT_DIRECTION, Stage } from './scene.js';
import { SurfaceView } from './surface-view.js';
import { theme, watchTheme } from './theme.js';

/** Radians by which an arrow key turns the camera, and the factor of the distance for + and -. */
const TURN = Math.PI / 24;
const ZOOM = 1.15;

const root = document.documentElement;
const query = new URLSearchParams(location.search);
const canvas = element('view', HTMLCanvasElement);

/** Shows why there is no surface. @param {string} text */
function refuse(text) {
  root.dataset.state = 'refused';
  write('message', text);
}

/** @param {string} url @returns {Promise<ArrayBuffer>} */
async function load(url) {
  const response = await fetch(url);
  if (response.ok) return response.arrayBuffer();
  const isProblem = response.headers.get('Content-Type')?.startsWith('application/problem+json');
  const problem = isProblem ? await response.json() : {};
  throw new Error(problem.errors?.[0]?.detail ?? problem.detail ?? `The service answered ${response.status}.`);
}

/** @param {WebGL2RenderingContext} context @param {ArrayBuffer} content */
async function show(context, content) {
  const stage = new Stage(canvas, context);
  const surface = new SurfaceView(stage);
  const paint = () => {
    surface.setLook('shaded', false, PALETTES[theme()], false);
    stage.paint(PALETTES[theme()]);
  };
  const fit = () => stage.fit(surface.points(), DEFAULT_DIRECTION);
  await surface.showMesh(content);
  stage.placeLights(surface.bounds());
  watchTheme(paint);
  fit();
  button('fit').addEventListener('click', fit);
  canvas.addEventListener('keydown', (event) => {
    /** @type {Record<string, () => void>} */
    const keys = {
      ArrowLeft: () => stage.turn(-TURN, 0), ArrowRight: () => stage.turn(TURN, 0),
      ArrowUp: () => stage.turn(0, TURN), ArrowDown: () => stage.turn(0, -TURN),
      '+': () => stage.zoom(1 / ZOOM), '=': () => stage.zoom(1 / ZOOM), '-': () => stage.zoom(ZOOM), f: fit,
    };
    const act = keys[event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act();
  });
  write('message', '');
  root.dataset.state = 'ready';
}

async function start() {
  const wanted = query.get('theme');
  if (wanted === 'light' || wanted === 'dark') root.dataset.theme = wanted;
  const src = query.get('src');
  if (src === null) {
    refuse('This address needs src, the path of a mesh: /embed?src=/v1/surfaces/utah-teapot/mesh.glb');
    return;
  }
  const url = resolveMesh(src, document.baseURI);
  const context = createContext(canvas);
  if (url === null) refuse('src is not the path of a mesh of this service, such as /v1/surfaces/utah-teapot/mesh.glb');
  else if (context === null) refuse('This browser does not support WebGL, so it cannot draw the surface.');
  else await show(context, await load(url));
}

start().catch((error) => {
  refuse(error instanceof TypeError ? 'The service does not answer.' : `The surface cannot be shown. ${error.message}`);
});
