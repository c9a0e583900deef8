// Removes the URLs for donations (`funding`) from package-lock.json, so that it names no host at all;
// the URLs for downloads are left out by `.npmrc`.

import { readFileSync, writeFileSync } from 'node:fs';

const LOCK = 'package-lock.json';  // of the package whose script runs this program

const lock = JSON.parse(readFileSync(LOCK, 'utf-8'));
Object.values(lock.packages).forEach((entry) => { delete entry.funding; });
writeFileSync(LOCK, `${JSON.stringify(lock, null, 2)}\n`);
