// Loads the part of the page that its first load leaves out (later.js).

import { NoResponse } from 'surface-service';
import { answers } from './presence.js';
import { Unreadable } from './unreadable.js';

export async function loadLater() {
  try {
    return await import('./later.js');
  } catch {
    if (!await answers()) throw new NoResponse();
    // The names of the modules contain hashes: another version of the service has others.
    const detail = 'The service has another version than this page.';
    throw new Unreadable({ code: 'page_outdated', detail, needed: 'that you reload the page; your drafts are kept' });
  }
}
