// `node types.js` prints the TypeScript types of the committed OpenAPI document.
// Fields with a default are optional; binary content has the type Blob, a list of three a tuple.

import { readFileSync } from 'node:fs';
import openapi, { astToString } from 'openapi-typescript';
import ts from 'typescript';

const DOCUMENT = new URL('../../openapi/openapi.json', import.meta.url);
const HEAD = `\
// Types of Surface Service, made from openapi.json by openapi-typescript: \`make types\`.
// Changes belong into the OpenAPI document.

`;
const MAX_TUPLE = 4;  // items: longer lists stay lists
const BLOB = ts.factory.createTypeReferenceNode('Blob');

/** Adds `prefixItems` to the schema of a list of fixed length, which is a tuple in the types. */
function markTuple(_, schema) {
  const { items, minItems, maxItems } = schema ?? {};
  return items && minItems === maxItems && minItems <= MAX_TUPLE
    ? { ...schema, prefixItems: Array(minItems).fill(items) } : schema;
}

const types = await openapi(JSON.parse(readFileSync(DOCUMENT, 'utf-8'), markTuple), {
  defaultNonNullable: false,
  rootTypes: true,
  rootTypesNoSchemaPrefix: true,
  transform: ({ format }) => (format === 'binary' ? BLOB : undefined),
});
process.stdout.write(HEAD + astToString(types));
