// Where a place in the text of a scenario is, and what the schema allows there: keys, values and their sentences.

const KEY = /^(\s*(?:- )*)(?:"([^"]*)"|'([^']*)'|([^\s#:{}[\],"'][^:#{}[\]"']*?))\s*:(?:\s|$)/;
const keyOf = (line) => { const found = line.match(KEY); return found && {indent: found[1].length, key: found[2] ?? found[3] ?? found[4], end: found[0].length}; };

// The keys from the root to the place (line, column; from 0): {path, key, siblings, value}. `key`: one is being written there;
// `value`: what is written behind a key, or null.
export function placeOf(lines, line, column) {
  const before = lines[line].slice(0, column);
  // Within { } on this line: the keys of that mapping.
  const open = before.lastIndexOf('{'), inner = open > before.lastIndexOf('}') ? before.slice(open + 1) : null;
  const here = keyOf(lines[line]);
  const path = [];
  let indent = inner !== null ? (here?.indent ?? 0) + 1 : here && before.length >= here.end ? here.indent : before.match(/^\s*(?:- )*/)[0].length;
  if (inner !== null && here) path.unshift(here.key);
  let limit = inner !== null ? (here?.indent ?? 0) : indent;
  const siblings = new Set();
  for (let i = line - 1; i >= 0; --i) {
    const found = keyOf(lines[i]);
    if (!found || /^\s*#/.test(lines[i])) continue;
    if (found.indent < limit) { path.unshift(found.key); limit = found.indent; } else if (inner === null && found.indent === limit && path.length === 0) siblings.add(found.key);
    if (limit === 0) break;
  }
  if (inner === null)
    for (let i = line + 1; i < lines.length; ++i) {
      const found = keyOf(lines[i]);
      if (found && found.indent < indent) break;
      if (found && found.indent === indent) siblings.add(found.key);
    }
  if (inner !== null) {
    for (const part of inner.split(',').slice(0, -1)) siblings.add(part.split(':')[0].trim());
    const last = inner.split(',').at(-1), colon = last.indexOf(':');
    return colon < 0 ? {path, key: last.trim(), siblings, value: null} : {path: [...path, last.slice(0, colon).trim()], key: null, siblings, value: last.slice(colon + 1).trim()};
  }
  if (here && before.length >= here.end - 1 && before.includes(':')) return {path: [...path, here.key], key: null, siblings, value: before.slice(before.indexOf(':') + 1).trim()};
  return {path, key: before.trim().replace(/^(- )*/, ''), siblings, value: null};
}

// All forms that a part of the schema may have, references followed.
function forms(schema, root) {
  if (!schema) return [];
  if (schema.$ref) return [...forms(schema.$ref.split('/').slice(1).reduce((at, key) => at?.[key], root), root).map((form) => ({...form, description: schema.description ?? form.description, default: schema.default ?? form.default}))];
  const choices = [...(schema.anyOf ?? []), ...(schema.oneOf ?? [])];
  const parts = (schema.allOf ?? []).flatMap((one) => forms(one, root));
  return choices.length || parts.length ? [...(schema.properties || schema.enum ? [schema] : []), ...choices.flatMap((one) => forms(one, root)), ...parts].map((form) => ({...form, description: schema.description ?? form.description, default: schema.default ?? form.default})) : [schema];
}

// The forms at a path: keys of the file, names of its own, and numbers of lists.
export function formsAt(schema, path) {
  let at = forms(schema, schema);
  for (const key of path)
    at = at.flatMap((form) => [form.properties?.[key] ?? (form.additionalProperties?.constructor === Object ? form.additionalProperties : null) ?? (form.items && forms(form.items, schema).map((item) => item.properties?.[key]).find(Boolean))].filter(Boolean)).flatMap((form) => forms(form, schema));
  return at;
}

const within = (form) => {
  const {minimum: low, exclusiveMinimum: above, maximum: high, exclusiveMaximum: below} = form;
  return [above !== undefined ? `> ${above}` : low !== undefined ? `≥ ${low}` : '', below !== undefined ? `< ${below}` : high !== undefined ? `≤ ${high}` : ''].filter(Boolean).join(', ');
};
// What a form allows, in a few words.
export function allowed(form) {
  const kind = [form.type].flat().filter((type) => type && type !== 'null').join(' or ');
  if (form.enum) return form.enum.join(', ');
  return [kind === 'array' && form.minItems === form.maxItems && form.minItems ? `${form.minItems} values` : kind, within(form)].filter(Boolean).join(', ');
}
export function sentenceOf(found) {
  const [first] = found;
  if (!first) return '';
  const what = [...new Set(found.map(allowed).filter(Boolean))].join('; or ');
  const otherwise = first.default !== undefined ? ` Without it: ${JSON.stringify(first.default)}.` : '';
  return `${first.description ?? ''}${what ? ` (${what})` : ''}${otherwise}`.trim();
}

// Keys that may stand at a place: {label, info, required}.
export function keysAt(schema, path, siblings = new Set()) {
  const made = new Map();
  for (const form of formsAt(schema, path).flatMap((one) => (one.items && !one.properties ? forms(one.items, schema) : [one])))
    for (const [label, of] of Object.entries(form.properties ?? {}))
      if (!siblings.has(label) && !made.has(label)) made.set(label, {label, info: sentenceOf(forms(of, schema)), required: Boolean(form.required?.includes(label)), below: forms(of, schema).some(({properties, additionalProperties}) => properties || additionalProperties?.constructor === Object)});
  return [...made.values()];
}
// Values that may stand behind the last key of a path: {label, info}.
export function valuesAt(schema, path) {
  const made = new Map();
  for (const form of formsAt(schema, path)) {
    const values = form.enum ?? ([form.type].flat().includes('boolean') ? [true, false] : []);
    for (const value of [...values, ...(form.default !== undefined && Object(form.default) !== form.default ? [form.default] : [])])
      made.set(String(value), {label: String(value), info: value === form.default ? 'the default' : ''});
  }
  return [...made.values()];
}

// The place of an error in a sentence FILE:LINE:COLUMN: ..., from 0, and the sentence without the file; or null.
export function errorAt(sentence) {
  const found = sentence.match(/^(.*?):(\d+):(\d+): ([\s\S]*)$/);
  return found && {line: Number(found[2]) - 1, column: Number(found[3]) - 1, message: found[4]};
}
