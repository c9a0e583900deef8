// The panel of the chosen control point: its number, coordinates and weight.

import { weightAt } from './net.js';
import { announce, button, element, input, write } from './page.js';

/** @typedef {import('./state.js').State} State */

const COORDINATES = /** @type {const} */ (['x', 'y', 'z']);

/** @param {State} state */
export function watchPointPanel(state) {
  const number = input('point');
  number.addEventListener('change', () => {
    const value = Math.round(Number(number.value));
    const count = state.net.handles.length;
    state.choose(number.value === '' ? -1 : Math.min(count, Math.max(1, value)) - 1);
    show(state);
  });
  button('point-previous').addEventListener('click', () => step(state, -1));
  button('point-next').addEventListener('click', () => step(state, 1));

  COORDINATES.forEach((name, axis) => {
    const field = input(name);
    // `keep`: whether the move is a step of the history; while the user types, it is not.
    const move = (/** @type {boolean} */ keep) => {
      const point = state.point();
      if (!point || field.value === '' || !Number.isFinite(field.valueAsNumber)) return;
      state.move(point.map((value, i) => (i === axis ? field.valueAsNumber : value)), keep);
    };
    field.addEventListener('input', () => move(false));
    // If the field is empty now, the last number that was typed stays.
    field.addEventListener('change', () => { move(true); state.commit(); show(state); });
  });

  element('move-by', HTMLFormElement).addEventListener('submit', (event) => {
    event.preventDefault();
    const offsets = COORDINATES.map((name) => input(`d${name}`).valueAsNumber);
    state.commit();
    state.moveBy(offsets);
  });

  const [weight, slider] = [input('weight'), input('weight-slider')];
  const weigh = (/** @type {number} */ value, /** @type {boolean} */ keep) => {
    if (Number.isFinite(value)) state.setWeight(value, keep);
  };
  weight.addEventListener('input', () => weigh(weight.valueAsNumber, false));
  weight.addEventListener('change', () => { weigh(weight.valueAsNumber, true); state.commit(); show(state); });
  // The slider has the logarithm of the weight to base 2.
  const sliderWeight = () => Number((2 ** Number(slider.value)).toPrecision(3));
  slider.addEventListener('input', () => weigh(sliderWeight(), false));
  slider.addEventListener('change', () => weigh(sliderWeight(), true));

  state.listen((change) => {
    if (change === 'opened') number.value = '';
    show(state);
    if (change === 'chosen' && state.chosen >= 0) announce(describe(state));
  });
  show(state);
}

/** Chooses the next or the previous point, in a circle. @param {State} state @param {number} difference  1 or −1 */
function step(state, difference) {
  const count = state.net.handles.length;
  if (count === 0) return;
  // Without a chosen point (−1), 1 leads to the first point and −1 to the last.
  const start = state.chosen < 0 && difference < 0 ? 0 : state.chosen;
  state.choose((start + difference + count) % count);
}

/** @param {State} state */
function show(state) {
  const { handle, chosen } = state;
  const count = state.net.handles.length;
  write('point-count', `of ${count.toLocaleString('en')}`);
  const number = input('point');
  number.max = String(count);
  [number, button('point-previous'), button('point-next')].forEach((control) => {
    control.disabled = count === 0;
  });
  // A number that the user is typing stays if no point is chosen.
  if (number !== document.activeElement || handle) number.value = handle ? String(chosen + 1) : '';
  element('point-fields', HTMLElement).hidden = !handle;
  const point = state.point() ?? [];
  COORDINATES.forEach((name, axis) => {
    input(name).disabled = point[axis] === undefined;
    put(name, point[axis]);
  });
  const { length } = state.selection;
  element('several', HTMLElement).hidden = length < 2;
  write('several-count', `${length.toLocaleString('en')} points move together, and get one weight.`);
  const weight = handle ? weightAt(state.surface, handle) : undefined;
  put('weight', weight);
  const slider = input('weight-slider');
  if (slider !== document.activeElement) slider.value = String(Math.log2(weight ?? 1));
  slider.setAttribute('aria-valuetext', weight === undefined ? 'none' : String(weight));
}

/** Sets a field, unless the user is typing the same value. @param {string} id @param {number | undefined} value */
function put(id, value) {
  const field = input(id);
  const text = value === undefined ? '' : String(value);
  if (field === document.activeElement && field.valueAsNumber === value) return;
  if (field.value !== text) field.value = text;
}

/** @param {State} state */
function describe(state) {
  const { length } = state.selection;
  if (length > 1) return `${length} control points chosen, the last is ${state.chosen + 1}`;
  const position = (state.point() ?? []).map((value) => Number(value.toPrecision(4))).join(', ');
  return `Control point ${state.chosen + 1} of ${state.net.handles.length}, at ${position}`;
}
