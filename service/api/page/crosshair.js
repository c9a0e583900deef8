// A crosshair that keys move over the view, to click without a mouse: C shows it, arrows move it, Enter clicks.

import { announce, element } from './page.js';
import { Vector2 } from './three.js';

/** How far an arrow key moves it, in CSS pixels; with Shift. */
const [STEP, LARGE_STEP] = [8, 48];
const MOVES = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/**
 * @param {HTMLCanvasElement} canvas
 * @param {(mouse: Vector2, x: number, y: number) => void} click  with the place from -1 to 1, and in CSS pixels
 */
export function watchCrosshair(canvas, click) {
  const cross = element('crosshair', HTMLElement);
  let [x, y] = [0, 0];
  const place = () => {
    x = Math.min(canvas.clientWidth, Math.max(0, x));
    y = Math.min(canvas.clientHeight, Math.max(0, y));
    cross.style.translate = `calc(${x}px - 50%) calc(${y}px - 50%)`;
  };
  const show = (/** @type {boolean} */ isShown) => {
    cross.hidden = !isShown;
    if (isShown) announce('Crosshair: arrows move it, Enter clicks, Escape puts it away');
  };
  canvas.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (press(event)) {
      event.preventDefault();
      event.stopImmediatePropagation();
    }
  }, { capture: true });
  canvas.addEventListener('blur', () => show(false));

  /** Handles a key; returns whether it has a meaning for the crosshair. @param {KeyboardEvent} event */
  function press({ key, shiftKey }) {
    if (key.toLowerCase() === 'c') {
      [x, y] = [canvas.clientWidth / 2, canvas.clientHeight / 2];
      place();
      show(cross.hidden !== false);
      return true;
    }
    if (cross.hidden) return false;
    const move = MOVES[/** @type {keyof typeof MOVES} */ (key)];
    if (move) {
      const step = shiftKey ? LARGE_STEP : STEP;
      [x, y] = [x + step * move[0], y + step * move[1]];
      place();
    } else if (key === 'Enter') {
      click(new Vector2(2 * x / canvas.clientWidth - 1, 1 - 2 * y / canvas.clientHeight), x, y);
    } else if (key === 'Escape') show(false);
    else return false;
    return true;
  }
}
