// What the page loads when it is first needed: reading files, checking meshes, pictures, changes of whole nets.
// As one module, so that the page shares few scripts with it.

export { Check } from './check.js';
export { addLine, deleteLine, insertKnot, mirror, mirrorChosen, raiseDegree, separateWeights } from './modelling.js';
export { showPictures } from './pictures.js';
export { findMesh, readSources } from './read-files.js';
