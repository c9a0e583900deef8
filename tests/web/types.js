// `node types.js` prints the TypeScript types of the committed OpenAPI document.
// Fields with a default are optional; binary content has the type Blob.

import { readFileSync } from 'node:fs';
import openapi, { astToString } from 'openapi-typescript';
import ts from 'typescript';

const DOCUMENT = new URL('../../openapi/openapi.json', import.meta.url);
const HEAD = `\
// Types of Surface Service, made from openapi.json by openapi-typescript: \`make types\`.
// Changes belong into the OpenAPI document.

`;
const BLOB = ts.factory.createTypeReferenceNode('Blob');

const types = await openapi(JSON.parse(readFileSync(DOCUMENT, 'utf-8')), {
  defaultNonNullable: false,
  rootTypes: true,
  rootTypesNoSchemaPrefix: true,
  transform: ({ format }) => (format === 'binary' ? BLOB : undefined),
});
process.stdout.write(HEAD + astToString(types));
