// HTML that shows a surface on another page, alone or pasted into it: an element of model-viewer, the
// script that defines the element, and what both need.

/** The script, at the version that is tested. The browser runs it only if it has this hash. */
const SCRIPT = 'https://cdn.jsdelivr.net/npm/@google/model-viewer@4.4.0/dist/model-viewer.min.js';
const HASH = 'sha384-wjsPzEO+lXOf7d9csIDfAQpPt2OKuUU3m0K9qsdKIuzX4N8czSF6hdh23eAbZa3p';

/**
 * @param {string} meshUrl  absolute, with `engine`
 * @param {string} name  letters, digits, `.`, `_` and `-`
 * @param {boolean} isPrivate  whether a key is needed to read the mesh
 */
export function buildSnippet(meshUrl, name, isPrivate) {
  const { origin, searchParams } = new URL(meshUrl);
  const needs = [
    `This page must be allowed to load a script from ${new URL(SCRIPT).origin} and to connect to ${origin}`,
    '(in a Content-Security-Policy: script-src, connect-src, and img-src blob:).',
    `${origin} must allow the origin of this page (SURFACE_CORS_ORIGINS; without it, all).`,
    `The mesh is never changed; a service with another engine than ${searchParams.get('engine')} answers 410: then copy this again.`,
    ...(isPrivate ? ['The surfaces of this service are private: replace the address in src by a signed one (/v1/sign).'] : []),
  ];
  const src = meshUrl.replaceAll('&', '&amp;');
  return `<!-- ${needs.join('\n     ')} -->
<script type="module" crossorigin="anonymous" src="${SCRIPT}"
  integrity="${HASH}"></script>
<model-viewer style="display: block; width: 100%; height: 480px" camera-controls shadow-intensity="1"
  src="${src}" alt="${name}"></model-viewer>
`;
}
