// The legend of the colours of curvatures.

import { diverging } from './colors.js';
import { element, write } from './page.js';

const LEGENDS = { gaussian: 'Gaussian curvature', mean: 'Mean curvature' };

/** Paints the scale of the legend. @param {HTMLCanvasElement} canvas @param {number} [low]  the value at its left end */
export function paintLegend(canvas, low = -1) {
  const context = canvas.getContext('2d');
  if (context === null) return;
  for (let x = 0; x < canvas.width; x += 1) {
    const [r, g, b] = diverging(low + (1 - low) * x / (canvas.width - 1)).map((c) => Math.round(255 * c));
    context.fillStyle = `rgb(${r} ${g} ${b})`;
    context.fillRect(x, 0, 1, canvas.height);
  }
}

/** Shows the range of the colours, or hides the legend. @param {string} look @param {import('./surface-view.js').SurfaceView} surfaceView */
export function showLegend(look, { hasCurvatures, range }) {
  const title = LEGENDS[/** @type {keyof typeof LEGENDS} */ (look)];
  element('legend', HTMLElement).hidden = title === undefined || !hasCurvatures;
  if (title === undefined) return;
  const limit = String(Number(range.toPrecision(2)));
  write('legend-title', title);
  write('legend-low', `−${limit}`);
  write('legend-high', `+${limit}`);
}
