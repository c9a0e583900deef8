// Light or dark: as the system says, or as the user chose by the button; the browser stores this choice.

import { button } from './page.js';

const KEY = 'surface-theme';

/** @returns {'light' | 'dark'} */
export function theme() {
  const chosen = document.documentElement.dataset.theme;
  if (chosen === 'light' || chosen === 'dark') return chosen;
  return matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light';
}

/** Shows the theme that the page has already, or else the stored one. @param {() => void} changed */
export function watchTheme(changed) {
  const storedTheme = document.documentElement.dataset.theme ?? recall();
  if (storedTheme) document.documentElement.dataset.theme = storedTheme;
  const toggle = button('theme');
  const show = () => {
    toggle.setAttribute('aria-pressed', String(theme() === 'dark'));
    changed();
  };
  toggle.addEventListener('click', () => {
    const next = theme() === 'dark' ? 'light' : 'dark';
    document.documentElement.dataset.theme = next;
    remember(next);
    show();
  });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', show);
  show();
}

// If the browser does not allow storage, the choice is not stored.

function recall() {
  try {
    const value = localStorage.getItem(KEY);
    return value === 'light' || value === 'dark' ? value : null;
  } catch {
    return null;
  }
}

/** @param {string} value */
function remember(value) {
  try {
    localStorage.setItem(KEY, value);
  } catch { /* see above */ }
}
