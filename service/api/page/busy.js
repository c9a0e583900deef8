// The bar of the work that the page waits for: what it is, how long it has taken, and a button that stops
// it. The bar appears after 0.3 s, so that it does not flicker during short work.

import { announce, button, element, write } from './page.js';
import { watchWorks, works } from './work.js';

/** Milliseconds before the bar appears. */
const DELAY = 300;
/** Milliseconds before the bar says how long the work has taken. */
const LONG = 1000;

/** @param {() => boolean} isDragging  whether Escape undoes a drag, and stops no work */
export function watchBusy(isDragging) {
  const bar = element('busy', HTMLElement);
  const stop = button('busy-stop');
  let timer = 0;

  const show = () => {
    clearTimeout(timer);
    const now = performance.now();
    const shown = [...works].filter(({ start }) => now - start >= DELAY);
    const hadFocus = document.activeElement === stop;
    if (shown.length > 0 && bar.hidden) announce(`${shown[0].what}. Escape stops it.`);
    bar.hidden = shown.length === 0;
    if (bar.hidden && hadFocus) element('view', HTMLElement).focus();
    if (!bar.hidden) {
      const [{ what, detail, start }] = shown;
      write('busy-what', shown.length === 1 ? what : `${what}, and ${shown.length - 1} more`);
      const seconds = now - start < LONG ? '' : `${Math.floor((now - start) / 1000)} s`;
      write('busy-detail', [detail, seconds].filter(Boolean).join(', '));
    }
    const next = Math.min(...[...works].map(({ start }) => nextChange(now - start)));
    if (works.size > 0) timer = setTimeout(show, next);
  };

  const stopAll = () => { for (const work of works) work.stop(); };
  stop.addEventListener('click', stopAll);
  addEventListener('keydown', (event) => {
    if (event.key !== 'Escape' || bar.hidden || isDragging() || document.querySelector('dialog[open]')) return;
    event.preventDefault();
    event.stopPropagation();
    stopAll();
  }, { capture: true });
  watchWorks(show);
}

/** Milliseconds until the text about work of this age changes. @param {number} age */
function nextChange(age) {
  return age < DELAY ? DELAY - age : LONG - (age % LONG);
}
