// Bundles the modules of the page, with three.js, into service/api/static/page: `make web`.
//
//   node build.mjs                    the files that the service serves, and manifest.json
//   node build.mjs --compress         these, and each script and style as Brotli: 1/7 smaller, in some seconds
//   node build.mjs --modules FOLDER   every module by its own name, for tests of single modules
//
// The name of each file contains a hash of its content, so that browsers keep the file for ever. The
// manifest has, for each file that a page names, its name with the hash, and the scripts that it imports.
// It also has a hash of every source: so the tests find a bundle that is older than its sources.

import { createHash } from 'node:crypto';
import { copyFileSync, existsSync, mkdirSync, readdirSync, readFileSync, renameSync, rmSync, writeFileSync } from 'node:fs';
import { basename, dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { brotliCompressSync, constants } from 'node:zlib';
import { build } from 'esbuild';

const WEB = dirname(fileURLToPath(import.meta.url));
const ROOT = dirname(WEB);
const PAGE = 'service/api/page';
const STATIC = 'service/api/static/page';
const CLIENT = join(ROOT, 'clients/typescript/src/index.ts');

/** The files that each page names; these import all others. Pages share no scripts, so each has few bytes. */
const PAGES = [['main.js', 'page.css', 'icon.svg'], ['embed.js', 'embed.css']];

const OPTIONS = {
  absWorkingDir: ROOT,
  bundle: true,
  splitting: true,
  format: 'esm',
  target: 'es2022',
  charset: 'utf8',
  loader: { '.svg': 'copy' },
  nodePaths: [join(WEB, 'node_modules')],
  alias: existsSync(CLIENT) ? { 'surface-service': CLIENT } : {},
  logLevel: 'warning',
};

/** The hash of a file, in hexadecimal. @param {string} path */
const hash = (path) => createHash('sha256').update(readFileSync(join(ROOT, path))).digest('hex');

/** @param {boolean} isCompressed */
async function bundle(isCompressed) {
  const folder = `${STATIC}.new`;
  rmSync(join(ROOT, folder), { recursive: true, force: true });
  const [inputs, outputs] = [{}, {}];
  for (const entries of PAGES) {
    const { metafile } = await build({
      ...OPTIONS,
      entryPoints: entries.map((name) => `${PAGE}/${name}`),
      entryNames: '[name]-[hash]',
      chunkNames: '[name]-[hash]',
      assetNames: '[name]-[hash]',
      outdir: folder,
      minify: true,
      legalComments: 'inline',
      metafile: true,
    });
    Object.assign(inputs, metafile.inputs);
    Object.assign(outputs, metafile.outputs);
  }
  /** The scripts that a script imports at once, also through others. @param {string} path @returns {string[]} */
  const listImports = (path) => outputs[path].imports
    .filter(({ kind }) => kind === 'import-statement')
    .flatMap(({ path: imported }) => [imported, ...listImports(imported)]);
  const files = {};
  for (const [path, { entryPoint }] of Object.entries(outputs)) {
    // A file of kind `copy` has no entry point, and its name begins with that of its source.
    const name = entryPoint ? basename(entryPoint) : PAGES.flat().find((entry) => isCopy(entry, basename(path)));
    if (name) files[name] = { file: basename(path), imports: [...new Set(listImports(path))].map((each) => basename(each)) };
  }
  const packages = [...new Set(Object.keys(inputs).map((path) => /node_modules\/([^/]+)\//.exec(path)?.[1]).filter(Boolean))];
  const sources = [...Object.keys(inputs).filter((path) => !path.includes('node_modules/')), 'web/build.mjs', 'web/package-lock.json'];
  const manifest = { files, packages, sources: Object.fromEntries(sources.sort().map((path) => [path, hash(path)])) };
  if (isCompressed) outputNames(outputs).forEach((name) => compressFile(join(ROOT, folder, name)));
  copyFileSync(join(WEB, 'node_modules/three/LICENSE'), join(ROOT, folder, 'LICENSE'));
  writeFileSync(join(ROOT, folder, 'manifest.json'), `${JSON.stringify(manifest, null, 1)}\n`);
  rmSync(join(ROOT, STATIC), { recursive: true, force: true });
  renameSync(join(ROOT, folder), join(ROOT, STATIC));
}

/** The names of the scripts and styles. @param {object} outputs */
const outputNames = (outputs) => Object.keys(outputs).map((path) => basename(path)).filter((name) => /\.(js|css)$/.test(name));

/** @param {string} path */
function compressFile(path) {
  const content = readFileSync(path);
  const params = { [constants.BROTLI_PARAM_LGWIN]: constants.BROTLI_MAX_WINDOW_BITS, [constants.BROTLI_PARAM_SIZE_HINT]: content.length };
  writeFileSync(`${path}.br`, brotliCompressSync(content, { params }));
}

/** Whether a file is the copy of an entry, with a hash in its name. @param {string} entry @param {string} file */
function isCopy(entry, file) {
  const [stem, suffix] = entry.split('.');
  return file.startsWith(`${stem}-`) && file.endsWith(`.${suffix}`);
}

/** @param {string} folder */
async function separate(folder) {
  const names = readdirSync(join(ROOT, PAGE)).filter((name) => name.endsWith('.js'));
  mkdirSync(folder, { recursive: true });
  await build({ ...OPTIONS, entryPoints: names.map((name) => `${PAGE}/${name}`), outdir: folder });
}

const [option, folder] = process.argv.slice(2);
if (option === '--modules') await separate(folder);
else await bundle(option === '--compress');
