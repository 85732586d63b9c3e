// Forms of the page, and requests and messages of others to its bridge, with hostile values: by a fixed seed. Nothing
// breaks, each request is answered, a refusal is shown, and the cell goes on. TAKT_FUZZ_ROUNDS=N does it N times as long.
import {strict as assert} from 'node:assert';
import {cpSync, readFileSync, readdirSync} from 'node:fs';
import WebSocket from 'ws';
import {chromium, executable, visit} from './browser.mjs';
import {sources, start, stop, takt, view} from './processes.mjs';

const rounds = Number(process.env.TAKT_FUZZ_ROUNDS ?? 1);
// Park and Miller 1988.
let seed = 1;
const random = () => (seed = (48271 * seed) % 2147483647) / 2147483647;
const pick = (list) => list[Math.floor(random() * list.length)];
const begun = Date.now();
const stage = (what) => console.log(`${((Date.now() - begun) / 1000).toFixed(1)} s: ${what}`);

cpSync(`${sources}/config`, 'config', {recursive: true});
const files = () => readdirSync('.').sort().join();
const running = await start('takt-server', ['config/scenarios/block_assembly.yaml', '--cell', process.env.TAKT_CELL, '--paused', '--snapshots', 'snapshots', '--recordings', 'recordings', '--scenarios', 'config/scenarios', '--edit']);
const {child: bridge, url} = await view();
const scenarios = readdirSync('config/scenarios').sort().join();
// The programs are there, answer, and compute with finite numbers; no file is where none belongs.
function sound(after) {
  assert.ok(running.exitCode === null && bridge.exitCode === null, `a program of takt has ended after ${after}`);
  assert.ok(takt('status').state !== undefined, after);
  const state = takt('state');
  for (const [name, {position: {x, y, z}, orientation: q}] of Object.entries(state.components ?? {})) assert.ok([x, y, z, q.x, q.y, q.z, q.w].every(Number.isFinite), `place of ${name} after ${after}`);
  assert.deepEqual(files().split(',').filter((name) => !['config', 'snapshots', 'recordings'].includes(name)), [], after);
}

const LONG = 'x'.repeat(100000), TEXTS = ['', ' ', '0', '-1', '1e999', 'NaN', 'Infinity', '1e308', '-0', '9'.repeat(400), 'null', '../../etc/passwd', '/etc/passwd', '/dev/zero', 'a/../../b', '..', '.', '%00', '\u0000', 'a\u0000b', '\n\r\t', '‮abc', '💥'.repeat(50), '\ud800',
  '<img src=x onerror="window.broken = 1">', '<script>window.broken = 1</script>', '"><svg onload="window.broken = 1">', '${7*7}', "'; DROP TABLE cells; --", '{"a": 1}', '[[[[', '__proto__', 'constructor', 'CON', '-rf', '*', LONG];
const VALUES = [...TEXTS, 0, -1, 1.5, -1e308, 1e308, 5e-324, 2 ** 53, 2 ** 63, -(2 ** 63), 4294967296, true, false, null, [], {}, [null], [[1]], [1e308, 1e308, 1e308], [0, 0, 0, 0], ['a', 'b', 'c'], {x: 1e308, y: 'a', z: null}, {x: 0, y: 0, z: 0, w: 0}];

stage('messages of others');
// Calls whose bytes were changed, texts that are no JSON or none of the protocol: the connection is answered or ended, others stay.
const head = (id, encoding, body) => { const bytes = Buffer.alloc(13); bytes[0] = 2; bytes.writeUInt32LE(1, 1); bytes.writeUInt32LE(id, 5); bytes.writeUInt32LE(encoding.length, 9); return Buffer.concat([bytes, Buffer.from(encoding), Buffer.from(body)]); };
const connect = async () => {
  const socket = new WebSocket(url.replace('http', 'ws'), ['foxglove.websocket.v1']), answers = new Map();
  socket.on('error', () => {});
  socket.on('message', (data, binary) => {
    if (binary && data[0] === 3) answers.get(data.readUInt32LE(5))?.(JSON.parse(data.subarray(13 + data.readUInt32LE(9))));
    if (binary) return;
    const {op, callId, message} = JSON.parse(data);
    if (op === 'serviceCallFailure') answers.get(callId)?.({result: 'failed', message});
  });
  await new Promise((done) => { socket.on('open', done); socket.on('close', done); });
  return {socket, answers};
};
const witness = await connect();
let calls = 0;
const callText = (body, {socket, answers} = witness) => new Promise((done, fail) => {
  const id = ++calls, late = setTimeout(() => fail(new Error(`no answer to ${body.slice(0, 300)}`)), 120000);
  answers.set(id, (answer) => { clearTimeout(late); answers.delete(id); done(answer); });
  socket.send(head(id, 'json', body));
});
const call = (request, args = {}) => callText(JSON.stringify({request, arguments: args}));
const MESSAGES = ['', '{', '[]', 'null', '1', '"x"', '{"op": 1}', '{"op": "subscribe"}', '{"op": "subscribe", "subscriptions": 7}', '{"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1e99}]}', '{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 1}, {"id": 1, "channelId": 2}]}',
  '{"op": "unsubscribe", "subscriptionIds": [4294967295, -1, "a"]}', '{"op": "unsubscribe", "subscriptionIds": {}}', '{"op": "advertise", "channels": [{}]}', `{"op": "${LONG}"}`, '['.repeat(50000), `${'{"a":'.repeat(20000)}1${'}'.repeat(20000)}`, '\u0000', '{"op": "subscribe", "op": "unsubscribe"}'];
for (let n = 0; n < 150 * rounds; ++n) {
  const {socket} = await connect();
  for (let k = 0; k < 8 && socket.readyState === WebSocket.OPEN; ++k) {
    const draw = random(), body = JSON.stringify({request: pick(['get_state', 'step', 'explain_part', 'x']), arguments: {steps: pick(TEXTS), part: pick(TEXTS)}}), bytes = head(Math.floor(1e9 * random()), pick(['json', 'json', '', 'cdr', LONG]), body);
    if (draw < 0.4) socket.send(pick(MESSAGES));
    else if (draw < 0.8) {
      for (let i = 1 + Math.floor(6 * random()); i > 0; --i) bytes[Math.floor((random() < 0.7 ? Math.min(20, bytes.length) : bytes.length) * random())] = Math.floor(256 * random());
      socket.send(bytes.subarray(0, random() < 0.5 ? bytes.length : Math.floor(bytes.length * random())));
    } else if (draw < 0.9) socket.send(Buffer.from(Array.from({length: Math.floor(40 * random())}, () => Math.floor(256 * random()))));
    else socket.ping(Buffer.alloc(Math.floor(125 * random())));
  }
  if (n % 10 === 0) assert.ok((await call('get_state')).values, 'another client is served');
  socket.terminate();
}
sound('messages');

stage('requests of others');
// Each request of the vocabulary with arguments of its own, of which some have hostile values; and without its form.
const vocabulary = new Map(readFileSync(`${sources}/docs/requests.md`, 'utf8').split(/^## /m).slice(1).map((text) => [text.match(/^\w+/)[0], [...(text.split('| result |')[0]).matchAll(/^\| `(\w+)` \|/gm)].map(([, name]) => name)]));
assert.ok(vocabulary.size > 40 && vocabulary.get('set_entity_state').includes('entity'), [...vocabulary.keys()].join());
const names = [...vocabulary.keys()].filter((name) => !['unload_scenario', 'set_state'].includes(name)), PLAUSIBLE = {entity: 'P', part: 'P', robot: 'Robot1', gripper: 'Gripper1', signal: 'Gripper1.close', process: '', uri: 'block_assembly.yaml', name: 'fuzz', pace: 'realtime'};
const refused = {};
let asked = 0;
for (let n = 0; n < 900 * rounds; ++n) {
  const name = names[n % names.length], args = {};
  for (const key of vocabulary.get(name)) if (random() < 0.8) args[key] = key in PLAUSIBLE && random() < 0.5 ? PLAUSIBLE[key] : pick(VALUES);
  if (random() < 0.2) args[pick(TEXTS).slice(0, 50)] = pick(VALUES);
  const answer = random() < 0.9 ? await call(name, args) : await callText(pick([JSON.stringify({request: name}), JSON.stringify({request: name, arguments: pick(VALUES)}), JSON.stringify({request: pick(VALUES), arguments: args}), JSON.stringify([name, args]), `{"request": "${name}", "arguments": {`, JSON.stringify(args)]));
  ++asked;
  if (answer.result !== 1) {
    refused[name] = (refused[name] ?? 0) + 1;
    assert.ok(typeof answer.message === 'string' && answer.message.length > 3 && answer.message.length < 5000, `${name} ${JSON.stringify(args).slice(0, 300)}: ${JSON.stringify(answer).slice(0, 300)}`);
  }
  if (n % 100 === 99) sound(`${name} ${JSON.stringify(args).slice(0, 300)}`);
}
assert.ok(Object.keys(refused).length > 30, JSON.stringify(refused));
assert.equal(readdirSync('config/scenarios').sort().join(), scenarios);
assert.equal((await call('load_scenario', {uri: 'block_assembly.yaml'})).result, 1);
await call('set_pace', {pace: 'realtime', factor: 1});

stage('forms');
const browser = await chromium.launch(executable()), {page, problems, until, ask} = await visit(browser, url, {width: 1400, height: 900});
await ask(() => takt.cell.renderer.setPixelRatio(0.1));
const fill = (locator, text) => locator.evaluate((field, value) => {
  field.value = value;
  for (const kind of ['input', 'change']) field.dispatchEvent(new Event(kind, {bubbles: true}));
}, text);
let filled = 0, answered = 0;
// What a form says of it, on the page; the button that belongs to the field.
const said = () => ask(() => `${document.querySelector('#answer').textContent}\n${document.querySelector('#menu-answer').textContent}`);
async function form(field, button, texts) {
  const [input, press] = [field, button].map((what) => (typeof what === 'string' ? page.locator(what) : what));
  for (const text of texts) {
    await fill(input, text);
    ++filled;
    if (press) {
      await ask(() => { for (const id of ['answer', 'menu-answer']) document.querySelector(`#${id}`).textContent = ''; });
      await press.evaluate((one) => one.click());
      await until(() => document.querySelector('#answer').textContent || document.querySelector('#menu-answer').textContent);
      ++answered;
      assert.ok((await said()).length < 3000, `${text.slice(0, 50)}: a sentence of ${(await said()).length} letters`);
    }
    assert.deepEqual(problems, [], `${field}: ${text.slice(0, 100)}`);
  }
}
const some = (count) => Array.from({length: count * rounds}, () => pick(TEXTS));
takt('pause');
const NUMBERS = ['', '0', '-1', '1e308', '-1e308', '1e-320', '1.5', '9'.repeat(300), 'x', '1e400'];
for (const [field, button, texts] of [['#steps', '#step', ['', '0', '-1', '1.5', '1e308', 'x', '9'.repeat(300)]], ['#factor', null, NUMBERS], ['#scale', null, NUMBERS], ['#find', null, TEXTS], ['#signal', '#add-plot', []], ['#signal', null, TEXTS]]) await form(field, button, texts);
await fill(page.locator('#scale'), '30');
await fill(page.locator('#find'), '');
await fill(page.locator('#signal'), '');
for (const [kind, name, fields, button] of [['component', 'P', ['x in mm', 'y in mm', 'z in mm'], 'put'], ['gripper', 'Gripper1', ['width in mm'], 'move']]) {
  await ask((chosen) => takt.select(chosen), {kind, name});
  takt('reset');
  if (kind === 'gripper') takt('play');
  const press = page.locator('#selection button', {hasText: new RegExp(`^${button}$`)});
  await until((text) => [...document.querySelectorAll('#selection button')].some(({textContent, disabled}) => textContent === text && !disabled), button);
  if (kind === 'component') {  // an empty field is no zero
    const before = JSON.stringify(takt('state').components.P.position);
    await form(page.locator('#selection input[aria-label="x in mm"]'), press, ['']);
    assert.equal(JSON.stringify(takt('state').components.P.position), before);
    assert.doesNotMatch(await said(), /was moved/);
  }
  for (const label of fields) await form(page.locator(`#selection input[aria-label="${label}"]`), press, NUMBERS);
  sound(`the form of ${name}`);
}
await ask(() => takt.select({kind: 'robot', name: 'Robot1'}));
for (const text of NUMBERS) { const input = page.locator('#selection input[aria-label$="in degrees"]').first(); await fill(input, text); await input.press('Enter'); ++filled; }
takt('pause');
takt('request', 'set_state', 'state=stopped');
await page.click('#menu');
await until(() => document.querySelector('#cell-menu').open && !document.querySelector('#save').disabled);
for (const [field, button] of [['#scenario-file', '#load'], ['#snapshot-name', '#save'], ['#recording-name', '#record'], ['#part-file', '#part-add'], ['#part-name', '#part-add'], ['#part-mass', '#part-add']]) {
  await form(field, button, some(8));
  sound(field);
}
for (const name of ['../outside', '/tmp/outside', 'a/b', '<img src=x onerror="window.broken = 1">']) for (const [field, button] of [['#snapshot-name', '#save'], ['#recording-name', '#record']]) await form(field, button, [name]);
await page.keyboard.press('Escape');
assert.equal(await ask(() => window.broken ?? null), null, 'a text of a form was executed');
assert.equal(await ask(() => document.querySelectorAll('img[src=x], body script:not([type])').length), 0);
assert.equal(readdirSync('config/scenarios').sort().join(), scenarios);
takt('step', '5');
sound('all');
witness.socket.terminate();
await browser.close();
await stop(bridge);
await stop(running);
console.log(`${asked} requests, ${Object.values(refused).reduce((sum, count) => sum + count, 0)} of them refused; ${filled} values in fields, ${answered} answers on the page`);
process.exit(0);
