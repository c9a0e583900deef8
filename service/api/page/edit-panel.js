// The section "Edit" of the panel: chooses several points, and changes whole nets (modelling.js). What has
// happened, and why something cannot be done, stands in it.

import { ServiceError } from 'surface-service';
import { Unchangeable } from './documents.js';
import { loadLater } from './load-later.js';
import { button, element, getChecked, input, radios, write } from './page.js';
import { hasLines, LINES, lineOf } from './selection.js';
import { explainRefusal, isHomogeneous } from './targets.js';
import { Outdated, Stopped } from './work.js';

/** @typedef {import('./targets.js').Change} Change */
/** @typedef {import('./selection.js').Direction} Direction */
/** @typedef {import('./state.js').State} State */
/** @typedef {typeof import('./later.js')} Modelling */

/** The buttons that change nets, and what kind of change each is. @type {[string, Change][]} */
const CHANGES = [
  ['add-line', 'rows'], ['delete-line', 'rows'], ['raise-degree', 'degree'], ['open-knot', 'knots'], ['open-mirror', 'mirror'],
];

/** @returns {Direction} */
const chosenDirection = () => (getChecked('direction') === 'v' ? 1 : 0);

/** @param {State} state @param {(error: Error) => void} failed  for errors that are no refusals */
export function watchEditPanel(state, failed) {
  watchChoices(state);
  let isBusy = false;
  /** Runs a change, and says in `place` what has come of it. @param {() => Promise<string> | string} act @param {string} place */
  const run = async (act, place = 'edit-problem') => {
    if (isBusy) return false;
    isBusy = true;
    tell('', '', place);
    show(state, isBusy);
    try {
      tell(await act(), '', place);
      return true;
    } catch (error) {
      if (error instanceof Unchangeable) tell('', error.message, place);
      else if (error instanceof ServiceError) tell('', describeRefusal(error), place);
      else if (error instanceof Outdated) tell('Nothing was done: the surface has changed meanwhile.', '', place);
      else if (error instanceof Stopped) tell('Stopped: nothing was done.', '', place);
      else failed(/** @type {Error} */ (error));
      return false;
    } finally {
      isBusy = false;
      show(state, isBusy);
    }
  };
  const onClick = (/** @type {string} */ id, /** @type {(modelling: Modelling) => Promise<string>} */ act) => {
    button(id).addEventListener('click', () => void run(async () => act(await loadLater())));
  };
  onClick('add-line', ({ addLine }) => addLine(state, chosenDirection()));
  onClick('delete-line', ({ deleteLine }) => deleteLine(state, chosenDirection()));
  onClick('raise-degree', ({ raiseDegree }) => raiseDegree(state, chosenDirection()));
  onClick('separate-weights', ({ separateWeights }) => separateWeights(state));

  watchDialog('knot', () => {
    const direction = chosenDirection();
    write('knot-label', `At ${'uv'[direction]}, for a new ${LINES[direction]}`);
    // The place that was clicked last, if it has parameters of this surface alone.
    const clicked = element('probe', HTMLDataElement).value.split(',')[direction];
    if (clicked && state.surface.control_net) input('knot').value = String(Number(Number(clicked).toPrecision(6)));
  }, () => run(async () => {
    const { insertKnot } = await loadLater();
    return insertKnot(state, chosenDirection(), input('knot').valueAsNumber);
  }, 'knot-problem'));
  watchDialog('mirror', () => {
    const hasPoints = state.selection.length > 0;
    radios('mirrored').forEach((radio) => {
      if (radio.value === 'points') radio.disabled = !hasPoints;
      if (!hasPoints && radio.value === 'surface' && getChecked('mirrored') === 'points') radio.checked = true;
    });
  }, () => {
    const plane = { axis: 'xyz'.indexOf(getChecked('mirror-axis')), offset: input('mirror-offset').valueAsNumber };
    const what = getChecked('mirrored');
    return run(async () => {
      const { mirror, mirrorChosen } = await loadLater();
      return what === 'points' ? mirrorChosen(state, plane) : mirror(state, plane, what === 'both');
    }, 'mirror-problem');
  });

  radios('direction').forEach((radio) => radio.addEventListener('change', () => show(state, isBusy)));
  state.listen((change) => {
    // A message is about the last change; after another one it is wrong.
    if (change !== 'settings' && change !== 'chosen') tell('', '', 'edit-problem');
    show(state, isBusy);
  });
  show(state, isBusy);
}

/** The buttons that choose points. @param {State} state */
function watchChoices(state) {
  button('choose-all').addEventListener('click', () => state.selectAround(state.net.handles.map((_, i) => i)));
  button('choose-none').addEventListener('click', () => state.select([]));
  button('choose-line').addEventListener('click', () => {
    if (state.chosen >= 0) state.selectAround(lineOf(state.net, state.chosen, chosenDirection()));
  });
  const several = button('choose-several');
  several.addEventListener('click', () => {
    several.setAttribute('aria-pressed', String(several.getAttribute('aria-pressed') !== 'true'));
  });
}

/**
 * Opens a dialog by its button, and closes it after its work is done.
 * @param {string} name @param {() => void} opened @param {() => Promise<boolean>} submitted
 */
function watchDialog(name, opened, submitted) {
  const dialog = element(`${name}-dialog`, HTMLDialogElement);
  button(`open-${name}`).addEventListener('click', () => {
    tell('', '', `${name}-problem`);
    opened();
    dialog.showModal();
  });
  element(`${name}-form`, HTMLFormElement).addEventListener('submit', (event) => {
    event.preventDefault();
    void submitted().then((isDone) => { if (isDone) dialog.close(); });
  });
}

/** Shows a message in the section, and a problem beside the question that it is about. @param {string} message @param {string} problem @param {string} place */
function tell(message, problem, place) {
  write('edit-message', message);
  write(place, problem);
  element(place, HTMLElement).hidden = problem === '';
}

/** @param {ServiceError} refusal */
function describeRefusal({ message, errors }) {
  if (errors.length === 0) return message;
  return errors.map(({ detail, got, needed }) => (
    [detail, got && `Got ${got}.`, needed && `Needed ${needed}.`].filter(Boolean).join(' ')
  )).join(' ');
}

/** @param {State} state @param {boolean} isBusy */
function show(state, isBusy) {
  const direction = chosenDirection();
  const reasons = CHANGES.map(([id, change]) => {
    const reason = explainRefusal(state, change);
    button(id).disabled = isBusy || reason !== '';
    return reason;
  });
  write('edit-why', reasons.find((reason) => reason !== '') ?? '');
  write('choose-line', `The ${LINES[direction]}`);
  const { chosen, handle, net, surface } = state;
  button('choose-line').disabled = !handle || !hasLines(handle);
  button('choose-none').disabled = chosen < 0;
  ['choose-all', 'choose-several'].forEach((id) => { button(id).disabled = net.handles.length === 0; });
  button('separate-weights').hidden = !isHomogeneous(surface);
  button('separate-weights').disabled = isBusy;
}
