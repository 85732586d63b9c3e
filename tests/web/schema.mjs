// The editor's view of a scenario: in every scenario that takt ships each key is found in the schema at its place, and keys that
// are there are not offered twice. Places in texts that are being written are as a reader of YAML would have them.
import {strict as assert} from 'node:assert';
import {readFileSync, readdirSync} from 'node:fs';

const sources = process.env.TAKT_SOURCES;
const {errorAt, formsAt, keysAt, placeOf, sentenceOf, valuesAt} = await import(`${sources}/client_lib/view/web/scenario_schema.js`);
const folder = `${sources}/config/scenarios`, schema = JSON.parse(readFileSync(`${folder}/scenario.schema.json`, 'utf8'));

let keys = 0;
for (const name of readdirSync(folder, {recursive: true}).filter((one) => one.endsWith('.yaml'))) {
  const lines = readFileSync(`${folder}/${name}`, 'utf8').split('\n');
  let block = null;  // indentation of a literal text, whose lines are no keys
  lines.forEach((line, i) => {
    const indent = line.search(/\S/);
    if (block !== null && (indent < 0 || indent > block)) return;
    block = /[|>][-+]?\s*$/.test(line) ? indent : null;
    const found = line.match(/^(\s*(?:- )*)([A-Za-z_][\w.-]*):(?:\s|$)/);
    if (!found) return;
    const {path, key} = placeOf(lines, i, found[1].length + found[2].length);
    assert.equal(key, found[2], `${name}:${i + 1}`);
    const forms = formsAt(schema, [...path, key]);
    assert.ok(forms.length > 0, `${name}:${i + 1}: no form of ${[...path, key].join('.')}`);
    ++keys;
  });
}
assert.ok(keys > 500, `${keys} keys`);

const at = (text) => {
  const before = text.slice(0, text.indexOf('|')), lines = text.replace('|', '').split('\n');
  const {siblings, ...place} = placeOf(lines, before.split('\n').length - 1, before.length - before.lastIndexOf('\n') - 1);
  return {...place, siblings: [...siblings].sort()};
};
assert.deepEqual(at('na|'), {path: [], key: 'na', siblings: [], value: null});
assert.deepEqual(at('parts:\n  A:\n    mesh: a.obj\n    ma|\n    hierarchy: 2\n  B: {}'), {path: ['parts', 'A'], key: 'ma', siblings: ['hierarchy', 'mesh'], value: null});
assert.deepEqual(at('solver:\n  method: |'), {path: ['solver', 'method'], key: null, siblings: [], value: ''});
assert.deepEqual(at('parts:\n  A: {mesh: a.obj, pos|}'), {path: ['parts', 'A'], key: 'pos', siblings: ['mesh'], value: null});
assert.deepEqual(at('solver: {method: imp|}'), {path: ['solver', 'method'], key: null, siblings: [], value: 'imp'});
assert.deepEqual(at('parts:\n  A:\n    mesh: a.obj\n|').path, []);

const labels = (list) => list.map(({label}) => label);
assert.ok(labels(keysAt(schema, [])).includes('parts'));
assert.ok(!labels(keysAt(schema, ['parts', 'A'], new Set(['mesh']))).includes('mesh'));
assert.ok(labels(keysAt(schema, ['parts', 'A'])).includes('mass_kg'));
assert.ok(labels(keysAt(schema, ['parts', 'A', 'pose'])).includes('position_m'));
assert.deepEqual(labels(valuesAt(schema, ['solver', 'method'])).filter((name) => ['implicit', 'cvode'].includes(name)).sort(), ['cvode', 'implicit']);
assert.match(sentenceOf(formsAt(schema, ['parts', 'A', 'hierarchy'])), /integer, ≥ 1, ≤ 1000/);
assert.deepEqual(errorAt('/tmp/a b.yaml:12:3: parts.A: found 1; allowed: x'), {line: 11, column: 2, message: 'parts.A: found 1; allowed: x'});
assert.equal(errorAt('no place'), null);
console.log(`${keys} keys of scenarios have their place in the schema`);
