// Runs the Khronos glTF validator. Each line of standard input is the path of a file; for each file
// the program prints the report as one line of JSON.
// Usage: node gltf_validator.mjs FOLDER_OF_THE_PACKAGE

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { createInterface } from "node:readline";

const validator = createRequire(import.meta.url)(process.argv[2]);
for await (const file of createInterface({ input: process.stdin })) {
  const report = await validator.validateBytes(new Uint8Array(readFileSync(file)), {
    uri: file,
    maxIssues: 0,
  });
  console.log(JSON.stringify(report));
}
