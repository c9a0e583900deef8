// Runs the Khronos glTF validator on a file and prints its report as JSON.
// usage: node gltf_validator.mjs FOLDER_OF_THE_PACKAGE FILE

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const [folder, file] = process.argv.slice(2);
const validator = createRequire(import.meta.url)(folder);
const report = await validator.validateBytes(new Uint8Array(readFileSync(file)), {
  uri: file,
  maxIssues: 0,
});
process.stdout.write(JSON.stringify(report));
