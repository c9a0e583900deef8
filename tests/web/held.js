// Runs in a page before its own scripts; returns the data of a model in the page's library.
// `await window.held()` lists the meshes; positions and normals are in world coordinates, right-handed
// with y up as in glTF, every number as the library itself reads it (dequantized, decoded).

(() => {
  // three.js reports every new scene to its developer tools, if they exist.
  const scenes = [];
  window.__THREE_DEVTOOLS__ = new EventTarget();
  window.__THREE_DEVTOOLS__.addEventListener('observe', ({ detail }) => {
    if (detail.isScene) scenes.push(detail);
  });

  /** The rows of an attribute of three.js; empty if the attribute does not exist. */
  const rowsOf = (attribute) => Array.from({ length: attribute?.count ?? 0 }, (_, i) => Array.from(
    { length: attribute.itemSize }, (__, k) => attribute.getComponent(i, k),
  ));

  const normalized = (row) => row.map((x) => x / Math.hypot(...row));

  function threeMesh(mesh, origin) {
    const { position, normal, color } = mesh.geometry.attributes;
    const world = origin.clone().invert().multiply(mesh.matrixWorld);
    const turn = mesh.normalMatrix.clone().getNormalMatrix(world);
    const point = mesh.position.clone();
    return {
      name: mesh.name,
      positions: rowsOf(position).map((row) => point.fromArray(row).applyMatrix4(world).toArray()),
      normals: rowsOf(normal)
        .map((row) => normalized(point.fromArray(row).applyMatrix3(turn).toArray())),
      colors: mesh.material.vertexColors ? rowsOf(color) : [],
      triangles: Array.from({ length: mesh.geometry.index.count }, (_, i) => mesh.geometry.index
        .getX(i)),
    };
  }

  /** The meshes below `root`, in the coordinates of its parent. */
  function heldByThree(root) {
    const meshes = [];
    root.updateWorldMatrix(true, true);
    const origin = root.parent?.matrixWorld ?? root.matrixWorld;
    root.traverse((node) => { if (node.isMesh) meshes.push(threeMesh(node, origin)); });
    return meshes;
  }

  /** `numbers` in rows of `size`. */
  const inRows = (numbers, size) => Array.from(
    { length: (numbers?.length ?? 0) / size },
    (_, i) => Array.from(numbers.slice(i * size, (i + 1) * size)),
  );

  function babylonMesh(mesh) {
    const { Vector3, Matrix } = window.BABYLON;
    let root = mesh;
    while (root.parent) root = root.parent;
    // Babylon is left-handed; its loader mirrors glTF by a node above everything.
    const mirror = mesh.getScene().useRightHandedSystem || root.name !== '__root__'
      ? Matrix.Identity() : root.computeWorldMatrix(true).clone().invert();
    const world = mesh.computeWorldMatrix(true).multiply(mirror);
    const turn = world.clone().invert().transpose();
    const through = (method, matrix) => (row) => {
      const { x, y, z } = Vector3[method](Vector3.FromArray(row), matrix);
      return [x, y, z];
    };
    const colors = mesh.getVerticesData('color');
    const vertices = mesh.getTotalVertices();
    return {
      name: mesh.name,
      positions: inRows(mesh.getVerticesData('position'), 3)
        .map(through('TransformCoordinates', world)),
      normals: inRows(mesh.getVerticesData('normal'), 3)
        .map((row) => normalized(through('TransformNormal', turn)(row))),
      colors: mesh.useVertexColors ? inRows(colors, (colors?.length ?? 0) / vertices) : [],
      triangles: Array.from(mesh.getIndices()),
    };
  }

  const heldByBabylon = (scene) => scene.meshes
    .filter((mesh) => mesh.getTotalVertices() > 0).map(babylonMesh);

  window.held = () => {
    const viewer = document.querySelector('model-viewer');
    if (viewer) {
      const scene = Object.getOwnPropertySymbols(viewer)
        .find(({ description }) => description === 'scene');
      const model = scene && viewer.loaded ? viewer[scene].model : null;
      return model ? heldByThree(model) : [];
    }
    if (window.BABYLON) return heldByBabylon(window.BABYLON.EngineStore.LastCreatedScene);
    return scenes.flatMap(heldByThree);
  };
})();
