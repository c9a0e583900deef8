// The pictures in the list of examples, which the service draws. The page asks for them when the list is
// opened: its first load does not wait for them.

import { currentKey } from './key.js';
import { client, readsArePrivate } from './service.js';

/**
 * Shows the pictures that are not shown yet: `data-picture` is the id of the surface. They are decoration:
 * one that does not come leaves its place empty until the list is opened again.
 * @param {Iterable<HTMLImageElement>} pictures
 */
export async function showPictures(pictures) {
  const { engine } = document.documentElement.dataset;
  const pathOf = (/** @type {HTMLImageElement} */ picture) => {
    const [width, height] = ['width', 'height'].map((name) => picture.getAttribute(name));
    return `v1/surfaces/${picture.dataset.picture}/image.png?width=${width}&height=${height}&engine=${engine}`;
  };
  if (!readsArePrivate()) {
    for (const picture of pictures) {
      picture.onerror = () => picture.removeAttribute('src');
      picture.src = pathOf(picture);
    }
    return;
  }
  // The browser sends no key for pictures; the client does, for one after the other.
  if (currentKey() === '') return;
  for (const picture of pictures) {
    const response = await client.request(pathOf(picture));
    picture.src = URL.createObjectURL(await response.blob());
  }
}
