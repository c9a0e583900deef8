// Runs in a page before its own scripts, and defines `window.readMeshes()`, which returns the meshes
// that the page's library has loaded. Positions and normals are in world coordinates, right-handed
// with y up as in glTF. All numbers are as the library reads them (dequantized, decompressed).

(() => {
  // three.js reports every new scene to its developer tools if these exist.
  const scenes = [];
  window.__THREE_DEVTOOLS__ = new EventTarget();
  window.__THREE_DEVTOOLS__.addEventListener('observe', ({ detail }) => {
    if (detail.isScene) scenes.push(detail);
  });

  /** The numbers of an attribute of three.js by vertex; empty if the attribute does not exist. */
  const readRows = (attribute) => Array.from({ length: attribute?.count ?? 0 }, (_, i) => Array.from(
    { length: attribute.itemSize }, (__, k) => attribute.getComponent(i, k),
  ));

  const normalize = (row) => row.map((x) => x / Math.hypot(...row));

  /** The data of a mesh of three.js, in the coordinates of a node with the world matrix `origin`.
   *  This script cannot import the classes of three.js, so it clones objects of the mesh to get a
   *  matrix and a vector to compute with. */
  function readThreeMesh(mesh, origin) {
    const { position, normal, color } = mesh.geometry.attributes;
    const world = origin.clone().invert().multiply(mesh.matrixWorld);
    const normalMatrix = mesh.normalMatrix.clone().getNormalMatrix(world);
    const vector = mesh.position.clone();
    return {
      name: mesh.name,
      positions: readRows(position).map((row) => vector.fromArray(row).applyMatrix4(world).toArray()),
      normals: readRows(normal)
        .map((row) => normalize(vector.fromArray(row).applyMatrix3(normalMatrix).toArray())),
      colors: mesh.material.vertexColors ? readRows(color) : [],
      triangles: Array.from({ length: mesh.geometry.index.count }, (_, i) => mesh.geometry.index
        .getX(i)),
    };
  }

  /** The meshes below `root`, in the coordinates of its parent, or of `root` if it has no parent. */
  function readFromThree(root) {
    const meshes = [];
    root.updateWorldMatrix(true, true);
    const origin = root.parent?.matrixWorld ?? root.matrixWorld;
    root.traverse((node) => { if (node.isMesh) meshes.push(readThreeMesh(node, origin)); });
    return meshes;
  }

  /** A list of numbers as rows of `size` numbers; empty without numbers. */
  const splitRows = (numbers, size) => Array.from(
    { length: (numbers?.length ?? 0) / size },
    (_, i) => Array.from(numbers.slice(i * size, (i + 1) * size)),
  );

  /** The data of a mesh of Babylon.js, in the coordinates of glTF. */
  function readBabylonMesh(mesh) {
    const { Vector3, Matrix } = window.BABYLON;
    let root = mesh;
    while (root.parent) root = root.parent;
    // Babylon.js is left-handed; its loader adds a root node that mirrors the model of glTF.
    const mirror = mesh.getScene().useRightHandedSystem || root.name !== '__root__'
      ? Matrix.Identity() : root.computeWorldMatrix(true).clone().invert();
    const world = mesh.computeWorldMatrix(true).multiply(mirror);
    const normalMatrix = world.clone().invert().transpose();
    const transform = (method, matrix) => (row) => {
      const { x, y, z } = Vector3[method](Vector3.FromArray(row), matrix);
      return [x, y, z];
    };
    const colors = mesh.getVerticesData('color');
    const vertices = mesh.getTotalVertices();
    return {
      name: mesh.name,
      positions: splitRows(mesh.getVerticesData('position'), 3)
        .map(transform('TransformCoordinates', world)),
      normals: splitRows(mesh.getVerticesData('normal'), 3)
        .map((row) => normalize(transform('TransformNormal', normalMatrix)(row))),
      colors: mesh.useVertexColors ? splitRows(colors, (colors?.length ?? 0) / vertices) : [],
      triangles: Array.from(mesh.getIndices()),
    };
  }

  const readFromBabylon = (scene) => scene.meshes
    .filter((mesh) => mesh.getTotalVertices() > 0).map(readBabylonMesh);

  window.readMeshes = () => {
    const viewer = document.querySelector('model-viewer');
    if (viewer) {
      const scene = Object.getOwnPropertySymbols(viewer)
        .find(({ description }) => description === 'scene');
      const model = scene && viewer.loaded ? viewer[scene].model : null;
      return model ? readFromThree(model) : [];
    }
    if (window.BABYLON) return readFromBabylon(window.BABYLON.EngineStore.LastCreatedScene);
    return scenes.flatMap(readFromThree);
  };
})();
