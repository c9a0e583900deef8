// The message in the bar: one sentence, with a button that does what it offers.

import { button, element, write } from './page.js';

/** Shows a message with a button. @param {string} text @param {string} label @param {() => void} act */
export function offer(text, label, act) {
  button('offer-act').textContent = label;
  button('offer-act').onclick = () => {
    hideOffer();
    act();
  };
  button('offer-close').onclick = hideOffer;
  element('offer', HTMLElement).hidden = false;
  write('offer-text', text);
}

export function hideOffer() {
  element('offer', HTMLElement).hidden = true;
  write('offer-text', '');
}
