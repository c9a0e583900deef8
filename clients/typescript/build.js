// `node build.js FOLDER` writes the package into a new folder, from which `npm pack` makes the file:
// one minified module with its map, and the types, among them those of the OpenAPI document.

import { execFileSync } from 'node:child_process';
import { copyFileSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { build } from '../../web/node_modules/esbuild/lib/main.js';

const ROOT = fileURLToPath(new URL('../..', import.meta.url));
const SOURCES = join(ROOT, 'clients', 'typescript');
const COMPILER = join(ROOT, 'tests', 'web', 'node_modules', 'typescript-7', 'bin', 'tsc');

if (process.argv[2] === undefined) throw new Error('needed: the folder of the package');
const folder = resolve(process.argv[2]);
mkdirSync(folder, { recursive: true });
await build({
  entryPoints: [join(SOURCES, 'src', 'index.ts')],
  outfile: join(folder, 'index.js'),
  bundle: true,
  minify: true,
  format: 'esm',
  target: 'es2022',
  sourcemap: true,
  sourceRoot: 'surface-service',
  logLevel: 'warning',
});
execFileSync(process.execPath, [COMPILER, '--project', SOURCES, '--outDir', folder], { stdio: 'inherit' });
// In the package, the types of the OpenAPI document are beside the other types.
const types = join(folder, 'types.d.ts');
writeFileSync(types, readFileSync(types, 'utf-8').replaceAll('../../../openapi/surface-service.js', './openapi.js'));
copyFileSync(join(ROOT, 'openapi', 'surface-service.d.ts'), join(folder, 'openapi.d.ts'));
for (const name of ['package.json', 'README.md']) copyFileSync(join(SOURCES, name), join(folder, name));
copyFileSync(join(ROOT, 'LICENSE'), join(folder, 'LICENSE'));
