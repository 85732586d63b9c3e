// takt view in Debian's Chromium: the page of a running cell, its controls, a restart of the server, a recording.
import {strict as assert} from 'node:assert';
import {closeSync, fstatSync, openSync, writeSync} from 'node:fs';
import {chromium, executable, visit} from './browser.mjs';
import {patient, program, server, start, stop, takt, view} from './processes.mjs';

const chromiumHere = executable();

let {child: bridge, url} = await view();  // before there is anything to see
// The cell stands while P is held, however seldom the page draws.
let running = await server('--paused', '--pause-at-end', '--set', 'duration_s=6.2', '--lod', '3', '--set', 'solver.method=implicit');
const browser = await chromium.launch(chromiumHere);
const {page, problems, until, ask} = await visit(browser, url, process.env.TAKT_SCREENSHOT ? {width: 1400, height: 900} : {width: 900, height: 560});
const pixels = async () => (await page.locator('#cell').screenshot()).toString('base64');

// Says how far it is, with the time.
const begun = Date.now();
const stage = (what) => console.log(`${((Date.now() - begun) / 1000).toFixed(1)} s: ${what}`);

// The page loads and knows the cell.
assert.equal(await page.locator('#connection').textContent(), 'connected');
assert.deepEqual(await ask(() => takt.last.description.robots.map(({name}) => name)), ['Robot1', 'Robot2']);
await until(() => document.querySelector('#status').textContent.includes('paused') || document.querySelector('#status').textContent.includes('stopped'));

stage('standing');
// A cell that stands sends its state again and again, and the page draws it once: drawing takes a processor here.
await until(() => {
  const {frames, settled} = takt.cell, stood = (window.stood ??= {frames: -1, heard: new Set()});
  if (!settled || frames !== stood.frames) { stood.frames = frames; stood.heard.clear(); }
  return stood.heard.add(takt.last.state).size > 10;
});

stage('steps');
// Steps are taken when the cell stands, as many as were asked for.
const before = takt('state').step;
await page.fill('#steps', '25');
await page.click('#step');
await until((step) => takt.last.state.step >= BigInt(step), before + 25);
assert.equal(takt('state').step, before + 25);

stage('play');
// It plays: parts and robots move, the picture changes.
const controller = await start('takt-controller', [program, ...patient]);
const first = await pixels();
await page.click('#play');
await until(() => takt.last.status.state === 2 && takt.last.state.time > 6);
assert.notEqual(await pixels(), first);
await until(() => takt.plots.tracks.size > 0 && [...takt.plots.tracks.values()].every(({x}) => x.length > 20));
assert.ok(await ask(() => [...takt.plots.tracks.values()].every(({x}) => x.every((value, i) => i === 0 || value > x[i - 1]))));
await until(() => document.querySelectorAll('#events li').length > 0);
assert.match(await page.locator('#events time').first().textContent(), /^\d+\.\d{3}$/);
await until(() => document.querySelector('#graph').textContent.includes('Gripper1') && takt.last.state.components.some(({state}) => state === 1));

stage('pause');
// A part is held: the scene graph has it where the state on DDS says it is.
await page.click('#pause');
await until(() => takt.last.status.state === 2 && document.querySelector('#pause').ariaPressed === 'true' && document.querySelector('#play').ariaPressed === 'false');
const state = takt('state');
await until((step) => takt.last.state.step === BigInt(step), state.step);
await until((step) => takt.cell.shown && takt.last.state.step === BigInt(step), state.step);
for (const [name, component] of Object.entries(state.components)) {
  const place = await ask((n) => takt.place(n), name);
  Object.values(component.position).forEach((value, i) => assert.ok(Math.abs(value - place[i]) < 1e-9, `${name}: ${place} is not ${Object.values(component.position)}`));
}
// A contact is shown as a disc at its centre of pressure with its area.
const contact = await ask(() => {
  const {center_of_pressure: c, area} = takt.last.contacts.contacts[0], {disc} = takt.cell.patches[0];
  return {c: [c.x, c.y, c.z], area, place: disc.position.toArray(), radius: disc.scale.x, visible: disc.visible};
});
assert.ok(contact.visible);
assert.deepEqual(contact.place, contact.c);
assert.ok(Math.abs(Math.PI * contact.radius ** 2 - contact.area) < 1e-9 || contact.radius === 0.002);
// Its elements in the colour of their pressure, on request; the cell stands, and they carry what the disc's arrow says.
await page.selectOption('#pressure', '*');
await until(() => takt.cell.pressed.size > 0 && takt.last.contact_pressures.pairs.length === takt.last.contacts.contacts.length);
const pressed = await ask(() => {
  const pair = takt.last.contact_pressures.pairs[0], contact = takt.last.contacts.contacts.find(({base, target}) => base === pair.base && target === pair.target);
  const mesh = takt.cell.pressed.get(`${pair.base}-${pair.target}`);
  const {position, color} = mesh.geometry.attributes, strongest = pair.pressures.indexOf(Math.max(...pair.pressures));
  return {count: position.count, elements: contact.elements, largest: pair.largest_pressure, reported: contact.largest_pressure,
    strongest: [color.getX(3 * strongest), color.getY(3 * strongest), color.getZ(3 * strongest)],
    onBase: mesh.parent.name === takt.last.description.components[pair.base].name,
    discs: takt.cell.patches.some(({disc}) => disc.visible)};
});
assert.equal(pressed.count, 3 * pressed.elements);
assert.ok(Math.abs(pressed.largest - pressed.reported) <= 1e-9 * pressed.reported, `${pressed.largest} Pa is not ${pressed.reported} Pa`);
assert.ok(pressed.onBase && !pressed.discs);
assert.ok(pressed.strongest[0] > 0.5 && pressed.strongest[2] < 0.1, `red where the pressure is largest: ${pressed.strongest}`);
// The legend names each pair, with its elements.
assert.deepEqual((await page.locator('#pressures div').allTextContents()).map((row) => row.replace(/: .*, /, ' ')), await ask(() => {
  const named = (index) => takt.last.description.components[index].name;
  return takt.last.contact_pressures.pairs.map(({base, target, pressures}) => `${named(base)}-${named(target)} ${pressures.length} elements`);
}));
if (process.env.TAKT_SCREENSHOT) {  // of one Part from nearby, and no answer in front of it
  await ask(() => { takt.select({kind: 'component', name: 'P'}); takt.eye.fit('iso', takt.cell.chosen, false); });
  await until(() => !document.querySelector('#answer').classList.contains('shown'));
  await until(() => takt.cell.settled);
  await page.screenshot({path: process.env.TAKT_SCREENSHOT.replace('.png', '_pressures.png')});
  await ask(() => { takt.select(null); takt.eye.fit('iso', null, false); });
}
await page.selectOption('#pressure', '');
await until(() => takt.cell.pressed.size === 0);
if (process.env.TAKT_SCREENSHOT) {
  await until(() => takt.cell.settled && !document.querySelector('#answer').classList.contains('shown'));
  await page.screenshot({path: process.env.TAKT_SCREENSHOT});
}

stage('topics in any order');
// The description arrives after all others: contacts wait for it.
const late = await visit(browser, url, {width: 500, height: 400}, {prepare: (made) => made.routeWebSocket(/^ws:/, (socket) => {
  const server = socket.connectToServer(), idOf = new Map();
  let kept = [];
  server.onMessage((message) => {
    if (typeof message === 'string') for (const {id, topic} of JSON.parse(message).channels ?? []) idOf.set(topic.split('/').at(-1), id);
    const channel = typeof message !== 'string' && message[0] === 1 ? message.readUInt32LE(1) : null;
    if (kept && channel === idOf.get('description')) return kept.push(message);
    socket.send(message);
    if (channel === idOf.get('contacts') && kept?.length) { kept.forEach((one) => socket.send(one)); kept = null; }
  });
})});
await late.until(() => takt.last.contacts && takt.cell.components.length > 0);
await late.until(() => takt.cell.patches.filter(({disc}) => disc.visible).length === takt.last.contacts.contacts.length);
assert.deepEqual(late.problems, []);
await late.page.context().close();

stage('plots');
// A plot that was asked for fills.
await page.fill('#signal', 'Robot1/joint_states.velocity.elbow_joint');
await page.click('#add-plot');
await page.click('#play');
await until(() => takt.plots.numbers('Robot1/joint_states.velocity.elbow_joint').x.length > 20);
await page.click('#pause');  // a page that draws all the time leaves no time for another

stage('observer');
// An observer looks, and cannot touch.
const observer = await browser.newPage({viewport: {width: 500, height: 400}});
await observer.goto(`${url}?observer`);
await observer.waitForFunction(() => takt.last.state, null, {timeout: 300000});
assert.ok(await observer.locator('#play').isDisabled());
await observer.close();

stage('a silent server');
// A server that stands still sends no status; the page says so until it goes on.
running.kill('SIGSTOP');
await until(() => /^silent for \d+ s$/.test(document.querySelector('#connection').textContent));
running.kill('SIGCONT');
await until(() => document.querySelector('#connection').textContent === 'connected');

stage('restart of the server');
// The server is started again: the page finds it by itself.
await stop(controller);
await stop(running);
await page.evaluate(() => { takt.last.state = undefined; takt.last.status = undefined; });
running = await server('--paused');
await until(() => takt.last.state && takt.last.status && takt.last.state.time === 0);
await page.click('#play');
await until(() => takt.last.state.time > 0.2);


stage('restart of takt view');
await stop(bridge);
await until(() => document.querySelector('#connection').className === 'off');
({child: bridge} = await view(new URL(url).port));
await until(() => document.querySelector('#connection').className === '');
await page.evaluate(() => { takt.last.state = undefined; });
await until(() => takt.last.state?.time > 0.2);
await page.click('#pause');
await until(() => takt.last.status.state === 2);
assert.deepEqual(problems, []);
await page.close();
await stop(running);

stage('recording');
// A recording, with a slider.
await (await start('takt-run', [...takt_run_arguments(), '--mcap', 'run.mcap', '--quiet'])).ended;
const player = await view(0, 'run.mcap');
const film = await browser.newPage({viewport: {width: 900, height: 500}});
await film.goto(player.url);
await film.waitForFunction(() => takt.last.state && !document.querySelector('#playback').hidden, null, {timeout: 300000});
const seek = (part) => film.evaluate((p) => {
  const slider = document.querySelector('#position');
  slider.value = p;
  slider.dispatchEvent(new Event('input'));
}, part);
await film.click('#pause');
// The key plays and pauses it, whatever the cell did while it was recorded, and the buttons show which.
const plays = (wanted) => film.waitForFunction((on) => takt.last.playback.playing === on && document.querySelector('#play').ariaPressed === String(on) && document.querySelector('#pause').ariaPressed === String(!on), wanted, {timeout: 300000});
await film.evaluate(() => takt.link.call('set_pace', {pace: 'realtime', factor: 0.01}));
await seek(0.5);
await plays(false);
await film.locator('#cell').focus();
await film.keyboard.press(' ');
await plays(true);
await film.keyboard.press(' ');
await plays(false);
await film.evaluate(() => takt.link.call('set_pace', {pace: 'realtime', factor: 1}));
await seek(0.75);
await film.waitForFunction(() => Math.abs(takt.last.state.time - 9) < 0.02, null, {timeout: 300000});
await seek(0.25);
await film.waitForFunction(() => Math.abs(takt.last.state.time - 3) < 0.02, null, {timeout: 300000});
await film.click('#play');
await film.waitForFunction(() => takt.last.state.time > 3.5, null, {timeout: 300000});
// The damaged part of a recording is reported, and the rest is shown.
await film.click('#pause');
const file = openSync('run.mcap', 'r+'), {size} = fstatSync(file);
writeSync(file, Buffer.alloc(Math.floor(0.2 * size)), 0, undefined, Math.floor(0.4 * size));
closeSync(file);
await seek(0.5);
await film.waitForFunction(() => document.querySelector('#place').textContent.includes('cannot be played from here'), null, {timeout: 300000});
assert.match(await film.locator('#answer').textContent(), /run\.mcap/);
await seek(0.1);
await film.waitForFunction(() => Math.abs(takt.last.state.time - 1.2) < 0.02, null, {timeout: 300000});
assert.doesNotMatch(await film.locator('#place').textContent(), /cannot/);
await browser.close();
await stop(player.child);
console.log('the page shows the cell, controls it, heals, and plays a recording');
process.exit(0);

function takt_run_arguments() { return ['run', `${process.env.TAKT_SOURCES}/config/scenarios/block_assembly.yaml`, '--duration', '12']; }
