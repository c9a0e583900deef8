// The settings in the panel and the buttons of the bar: they show the state, and change it.

import { button, checkRadio, input, radios, write, element } from './page.js';
import { chooseAccuracy, chooseLook, hasPart, hasSweep, RANGES, relativeTolerance } from './settings.js';

/** @typedef {import('./settings.js').Settings} Settings */
/** @typedef {import('./state.js').State} State */

/** The meaning of the colours; `shaded` needs no text. @type {Record<Settings['look'], string>} */
const EXPLANATIONS = {
  shaded: '',
  normals: 'The colour shows the direction of the normal.',
  gaussian: 'Orange bends like a ball, blue like a saddle; pale is flat or bends in one direction only.',
  mean: 'Orange bends towards its normals, like the inside of a bowl; blue away from them.',
  zebra: 'Stripes break where the normal jumps, and have a kink where the curvature does.',
};

const NO_CURVATURES = 'Meshes of tubes and ribbons have no colours of curvature. A click shows the curvatures of tubes that are exact patches.';

/** @param {State} state */
export function watchPanel(state) {
  Object.entries(RANGES).forEach(([id, [min, max]]) => Object.assign(input(id), { min, max }));
  radios('look').forEach((radio) => radio.addEventListener('change', () => {
    state.set({ look: /** @type {Settings['look']} */ (radio.value) });
  }));
  radios('accuracy').forEach((radio) => radio.addEventListener('change', () => {
    state.set({ accuracy: /** @type {Settings['accuracy']} */ (radio.value) });
  }));
  input('stripes').addEventListener('input', (event) => state.set({ stripes: valueOf(event) }));
  radios('stripe-axis').forEach((radio) => radio.addEventListener('change', () => {
    state.set({ stripeAxis: /** @type {Settings['stripeAxis']} */ (radio.value) });
  }));
  input('show-net').addEventListener('change', (event) => state.set({ net: isOn(event) }));
  input('show-wires').addEventListener('change', (event) => state.set({ wires: isOn(event) }));
  input('resolution').addEventListener('input', (event) => state.set({ resolution: valueOf(event) }));
  input('tolerance').addEventListener('input', (event) => state.set({ tolerance: valueOf(event) }));

  button('undo').addEventListener('click', () => state.undo());
  button('redo').addEventListener('click', () => state.redo());
  button('reset').addEventListener('click', () => state.reset());
  button('help').addEventListener('click', () => element('guide', HTMLDialogElement).showModal());
  addEventListener('keydown', (event) => {
    if (isTyping(event.target) || event.altKey || !(event.ctrlKey || event.metaKey)) return;
    const key = event.key.toLowerCase();
    if (key === 'z' && !event.shiftKey) state.undo();
    else if ((key === 'z' && event.shiftKey) || key === 'y') state.redo();
    else return;
    event.preventDefault();
  });

  state.listen(() => show(state));
  show(state);
}

/** @param {State} state */
function show({ settings, history, surface }) {
  const look = chooseLook(settings, surface);
  checkRadio('look', look);
  // The reason why two looks are disabled stands where the meaning of the colours would.
  write('look-explained', EXPLANATIONS[look] || (hasSweep(surface) ? NO_CURVATURES : ''));
  radios('look').forEach((radio) => {
    radio.disabled = (radio.value === 'gaussian' || radio.value === 'mean') && hasSweep(surface);
  });
  element('zebra', HTMLElement).hidden = look !== 'zebra';
  input('stripes').value = String(settings.stripes);
  write('stripes-value', String(settings.stripes));
  checkRadio('stripe-axis', settings.stripeAxis);
  const accuracy = chooseAccuracy(settings, surface);
  checkRadio('accuracy', accuracy);
  radios('accuracy').forEach((radio) => { radio.disabled = radio.value !== 'tolerance' && hasPart(surface); });
  element('net-switch', HTMLElement).hidden = surface.type === 'brep';
  element('point-section', HTMLElement).hidden = surface.type === 'brep';
  input('show-net').checked = settings.net;
  input('show-wires').checked = settings.wires;
  input('resolution').value = String(settings.resolution);
  input('tolerance').value = String(settings.tolerance);
  write('resolution-value', String(settings.resolution));
  const share = `${Number((100 * relativeTolerance(settings)).toPrecision(3))} %`;
  write('tolerance-value', share);
  input('tolerance').setAttribute('aria-valuetext', share);
  document.querySelectorAll('.slider[data-for]').forEach((slider) => {
    /** @type {HTMLElement} */ (slider).hidden = slider.getAttribute('data-for') !== accuracy;
  });
  button('undo').disabled = !history.canUndo;
  button('redo').disabled = !history.canRedo;
  button('reset').disabled = !history.canReset;
  element('edited', HTMLElement).hidden = !history.canReset;
}

/** Whether the keys of undo and redo are for a text that the user types. Fields of numbers show the document. @param {EventTarget | null} target */
function isTyping(target) {
  return target instanceof HTMLTextAreaElement
    || (target instanceof HTMLInputElement && ['text', 'search', 'password'].includes(target.type));
}

/** @param {Event} event */
function isOn(event) {
  return /** @type {HTMLInputElement} */ (event.currentTarget).checked;
}

/** @param {Event} event */
function valueOf(event) {
  return Number(/** @type {HTMLInputElement} */ (event.currentTarget).value);
}
