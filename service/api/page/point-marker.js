// The number of the chosen control point, beside the point.

import { element } from './page.js';

/** Writes the number beside the point, if the net is shown. @param {number} chosen  -1 for none @param {import('./net-view.js').NetView} netView */
export function placeMarker(chosen, netView) {
  const marker = element('marker', HTMLElement);
  const isShown = chosen >= 0 && chosen < netView.positions.count && netView.group.visible;
  marker.hidden = !isShown;
  if (!isShown) return;
  const { x, y } = netView.screenPosition(chosen);
  marker.dataset.x = x.toFixed(1);
  marker.dataset.y = y.toFixed(1);
  // On the left below, where no arrow of the gizmo is.
  marker.style.translate = `calc(${x - 8}px - 100%) ${y + 6}px`;
  marker.textContent = String(chosen + 1);
}
