// Views from the front, from above, and so on, without perspective if one likes: buttons, and keys in the view.

import { announce, button, element, input } from './page.js';
import { Vector3 } from './three.js';

/** @typedef {import('./state.js').State} State */
/** @typedef {import('./view.js').View} View */

/** From the surface to the camera, in the scene, whose y points up; the front is that of glTF. A camera exactly
 *  above would not know which side of its picture is up. */
const DIRECTIONS = {
  front: [0, 0, 1],
  back: [0, 0, -1],
  left: [-1, 0, 0],
  right: [1, 0, 0],
  top: [0, 1, 1e-5],
  bottom: [0, -1, 1e-5],
  isometric: [1, 1, 1],
};

/** @param {State} state @param {View} view */
export function watchViews(state, view) {
  const names = /** @type {(keyof typeof DIRECTIONS)[]} */ (Object.keys(DIRECTIONS));
  const look = (/** @type {keyof typeof DIRECTIONS} */ name) => {
    view.fit(new Vector3().fromArray(DIRECTIONS[name]));
    announce(`View: ${name}`);
  };
  names.forEach((name) => button(`view-${name}`).addEventListener('click', () => look(name)));
  const box = input('orthographic');
  box.addEventListener('change', () => state.set({ orthographic: box.checked }));
  const show = () => {
    box.checked = state.settings.orthographic;
    if (view.stage.isOrthographic !== box.checked) view.stage.setOrthographic(box.checked);
  };
  state.listen(show);
  show();

  element('view', HTMLCanvasElement).addEventListener('keydown', ({ key, ctrlKey, metaKey, altKey }) => {
    if (ctrlKey || metaKey || altKey) return;
    const name = names[Number(key) - 1];
    if (name !== undefined) look(name);
    else if (key.toLowerCase() === 'o') state.set({ orthographic: !state.settings.orthographic });
  });

  // The list closes like a menu: by Escape, and by a click elsewhere.
  const list = element('views', HTMLDetailsElement);
  list.addEventListener('keydown', (event) => {
    if (event.key !== 'Escape' || !list.open) return;
    list.open = false;
    list.querySelector('summary')?.focus();
  });
  addEventListener('pointerdown', (event) => {
    if (!list.contains(/** @type {Node} */ (event.target))) list.open = false;
  }, { capture: true });
}
