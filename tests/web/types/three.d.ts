// The types of `page/three.js`, which is bundled from `web/three.js` when the service is installed.

export * from 'three';
export { OrbitControls } from 'three/addons/controls/OrbitControls.js';
export { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
