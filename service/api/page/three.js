// three.js, as the modules of the page import it. The bundle contains only the parts that they use.

export * from 'three';
export { OrbitControls } from 'three/addons/controls/OrbitControls.js';
export { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
