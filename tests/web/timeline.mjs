// Curves, timeline and history of takt view in Debian's Chromium, by pointer and by keys. A recorder on DDS is the witness: the
// picture of a past time is the state that it has of that step, files of plots have its numbers, and the cell goes on meanwhile.
import {strict as assert} from 'node:assert';
import {execFileSync} from 'node:child_process';
import {existsSync, readFileSync, statSync} from 'node:fs';
import {chromium, executable, point, visit} from './browser.mjs';
import {patient, program, server, start, stop, takt, view} from './processes.mjs';

const browser = await chromium.launch(executable());
const begun = Date.now();
const stage = (what) => console.log(`${((Date.now() - begun) / 1000).toFixed(1)} s: ${what}`);
const exported = (file) => execFileSync(`${process.env.TAKT_BIN}/takt`, ['--json', 'export', file], {encoding: 'utf8', maxBuffer: 1 << 30}).trim().split('\n').map((line) => JSON.parse(line));
// This test looks at numbers, not at the picture: a coarse one leaves the processor to the cell where software draws it.
const coarse = (ask) => ask(() => takt.cell.renderer.setPixelRatio(0.1));
const slide = (page, part) => page.locator('#position').evaluate((slider, value) => { slider.value = value; slider.dispatchEvent(new Event('input')); }, part);

stage('curves from the tree, by keys');
const running = await server('--paused', '--lod', '3', '--set', 'solver.method=implicit');
const {child: bridge, url} = await view();
const {page, problems, until, ask} = await visit(browser, url, {width: 1400, height: 900});
await coarse(ask);
const drawn = async () => {
  while (await ask(() => takt.plots.dirty));
  await ask(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
};
const names = () => ask(() => takt.plots.names());
await until(() => takt.plots.plots.length === 2);
for (const n of [1, 2]) await page.locator('.plot').last().press('Delete');
assert.deepEqual(await names(), []);
// A group, a robot, a quantity, a joint: opened by the right arrow, one lower by the down arrow, added by Enter.
await page.locator('#signal').focus();
await page.keyboard.press('ArrowDown');
await until(() => document.activeElement.textContent.startsWith('Robots'));
for (const [opened, below] of [['Robots', 'Robot1'], ['Robot1', 'position'], ['position', 'shoulder_pan_joint']]) {
  await page.keyboard.press('ArrowRight');
  await until((title) => [...document.querySelectorAll('#signals wa-tree-item')].find(({textContent}) => textContent.startsWith(title)).querySelector('wa-tree-item'), opened);
  await until((title) => { const item = document.activeElement; return item.textContent.startsWith(title) && item.expanded; }, opened);
  await page.keyboard.press('ArrowDown');
  await until((wanted) => document.activeElement.textContent.startsWith(wanted), below);
}
assert.equal(await ask(() => document.activeElement.querySelector('small').textContent), 'rad');
await page.keyboard.press('Enter');
await page.keyboard.press('ArrowDown');
await page.keyboard.press('Enter');
await page.keyboard.press('ArrowDown');
await page.keyboard.press('Shift+Enter');
const joint = (name, quantity = 'position') => `state.robots.Robot1.${quantity}.${name}_joint`;
assert.deepEqual(await names(), [[joint('shoulder_pan'), joint('shoulder_lift')], joint('elbow')]);
// The same unit shares an axis, another one has the right axis, a third one a plot of its own.
await page.locator('.plot').first().focus();
const search = async (text, key = 'Enter') => { await page.fill('#signal', text); await page.locator('#signal').press(key); };
await search('Robot1 position wrist_1');
await search('Robot1 velocity shoulder_lift');
await search('P position z');
assert.deepEqual(await names(), [[joint('shoulder_pan'), joint('shoulder_lift'), joint('wrist_1'), joint('shoulder_lift', 'velocity')], joint('elbow'), 'state.components.P.position.z']);
assert.deepEqual(await ask(() => takt.plots.plots.map((plot) => takt.plots.units(plot))), [['rad', 'rad/s'], ['rad'], ['m']]);
assert.deepEqual(await ask(() => takt.plots.plots[0].chart.series.slice(1).map(({scale}) => scale)), ['y0', 'y0', 'y0', 'y1']);
assert.equal(new Set(await ask(() => takt.plots.plots[0].curves.map(takt.plots.stroke))).size, 4);
// By the pointer: a click adds to the chosen plot, a signal that is dragged comes where it is dropped.
await page.fill('#signal', 'P position x');
await page.click('#signals wa-tree-item');
await page.fill('#signal', 'Robot1 position wrist_2');
await page.locator('#signals wa-tree-item').first().dragTo(page.locator('.plot').nth(1));
await page.fill('#signal', '');
assert.deepEqual((await names()).slice(1), [[joint('elbow'), joint('wrist_2')], ['state.components.P.position.z', 'state.components.P.position.x']]);
await page.locator('.plot').nth(1).locator('li', {hasText: 'wrist_2'}).locator('button').click();
assert.deepEqual((await names())[1], joint('elbow'));

const low = () => ask(() => document.querySelector('#bottom').offsetHeight), narrow = await low();
for (let n = 0; n < 5; ++n) await page.locator('#grip').press('ArrowUp');
assert.equal(await low(), narrow + 150);

stage('the cell runs, and a recorder listens');
const recorder = await start('takt', ['record', 'seen.mcap', ...patient]);
while (!existsSync('seen.mcap') || statSync('seen.mcap').size < 20000) await new Promise((resolve) => setTimeout(resolve, 20));
const controller = await start('takt-controller', [program, ...patient]);
await page.click('#play');
await until(() => takt.last.state.time > 3);

stage('history');
// The cell goes on while the page shows the time before. Nothing was asked of it: its events are the same. Samples are sent best
// effort, so that the witness may lack one of several times.
const plain = () => ask(() => JSON.parse(JSON.stringify(takt.lower.state, (key, value) => (typeof value === 'bigint' ? Number(value) : ArrayBuffer.isView(value) ? [...value] : value))));
const instants = [];
// The slider's way is that of the last picture, and a page that draws seldom may have one from long ago: the places are those
// of three instants that lie on it, apart from one another.
const slideTo = ({share, last_s}) => {
  const {from, to, newest} = takt.lower.timeline, slider = document.querySelector('#position');
  const frames = takt.lower.past.states.frames.filter(({time}) => time > from && time < newest && !(Math.abs(time - last_s) < 0.1));
  if (frames.length < 10) return false;
  slider.value = (frames[Math.floor(share * frames.length)].time - from) / (to - from);
  return slider.dispatchEvent(new Event('input'));
};
for (const share of [0.3, 0.7, 0.5]) {
  const last = instants.at(-1)?.shown.step ?? null;
  await until(slideTo, {share, last_s: instants.at(-1)?.shown.time ?? -1});
  await until((step) => takt.lower.past.shown !== null && Number(takt.lower.state.step) !== step, last);
  const shown = await plain();
  await until((time) => document.querySelector('#clock').textContent === `${time.toFixed(3)} s`, shown.time);
  instants.push({shown, ...await ask(() => ({badge: document.querySelector('#ago').textContent, step: Number(takt.lower.state.step), newest: takt.last.state.time,
    components: takt.last.description.components.map(({name}) => name), place: takt.place('P'), joints: takt.cell.robots[0].joints.map((name) => [name, takt.cell.robots[0].model.joints[name].angle])}))});
}
const before = takt('state').step;
await until((step) => takt.last.state.step > BigInt(step) + 20n, before);
assert.equal(takt('status').state, 'playing');
assert.ok(takt('state').step > before);
for (const {shown, badge, step, newest} of instants) {
  assert.equal(step, shown.step);
  const ago = Number(badge.match(/^history −(\d+\.\d) s$/)[1]);
  assert.ok(ago > 0 && ago <= newest - shown.time + 0.05, `${badge} at ${newest} s of ${shown.time} s`);
}
// What acts upon the cell says so, and the inspector's buttons wait for the present.
await ask(() => takt.select({kind: 'component', name: 'P'}));
await until(() => document.querySelector('#selection .why').textContent.includes('past'));
assert.ok(await page.locator('#selection button', {hasText: 'put'}).isDisabled());
instants.at(-1).inspected = (await page.locator('#selection tr', {hasText: 'position'}).locator('td').nth(1).textContent()).trim().split(/[\s]+/).slice(0, 3).map(Number);
// The cell stands from here on, so that events have one time and times that are shown stay.
await page.click('#pause');
await until(() => takt.last.status.state === 2);
const {step: end} = takt('state');
await until((step) => takt.last.state.step === BigInt(step), end);
for (const factor of ['1.1', '1.2', '1.3']) { await page.fill('#factor', factor); await page.locator('#factor').press('Enter'); await until((wanted) => takt.last.status.pace_factor === wanted, Number(factor)); }
await until(() => document.querySelector('#answer').textContent.includes('history −'));

stage('the cursor');
// Over one plot it is over all, with the values at its time.
await drawn();
const over = page.locator('.plot .u-over');
let box;
const onPlot = async (part, down) => { box = await over.first().boundingBox(); await page.mouse.move(box.x + part * box.width - 1, box.y + down); await page.mouse.move(box.x + part * box.width, box.y + down); };
await point(page, () => onPlot(0.3, 40), () => takt.plots.cursor !== null && Math.abs(takt.plots.plots[0].chart.cursor.left / takt.plots.plots[0].chart.over.clientWidth - 0.3) < 0.02);
await drawn();
const values = await ask(() => {
  const {plots} = takt, time = plots.cursor;
  return {cursors: plots.plots.map(({chart}) => chart.cursor.left / chart.over.clientWidth), texts: plots.plots.flatMap(({curves}) => curves.map(({name, unit, newest}) => {
    const {x, y} = plots.numbers(name);
    return {name, unit, text: newest.textContent, value: y[x.findLastIndex((one) => one <= time)]};
  }))};
});
for (const part of values.cursors) assert.ok(Math.abs(part - 0.3) < 0.02, `cursors at ${values.cursors}`);
for (const {name, unit, text, value} of values.texts) {
  const [number, ...rest] = text.split(' ');
  assert.equal(rest.join(' '), unit, name);
  assert.ok(Math.abs(Number(number) - value) <= 1e-3 * Math.abs(value) + 1e-9, `${name}: ${text} is not ${value}`);
}
await page.mouse.move(10, 10);

stage('zoom');
await drawn();
const range = () => ask(() => takt.plots.shown());
const [least, most] = await range();
await onPlot(0.2, 40);
await page.mouse.down();
await page.mouse.move(box.x + 0.6 * box.width, box.y + 45, {steps: 5});
await page.mouse.up();
await until((width) => { const [from, to] = takt.plots.shown(); return to - from < width; }, 0.7 * (most - least));
const [from, to] = await range();
assert.ok(Math.abs((to - from) / (most - least) - 0.4) < 0.05, `${from}..${to} of ${least}..${most}`);
await drawn();
assert.deepEqual(await ask(() => takt.plots.plots.map(({chart}) => [chart.scales.x.min, chart.scales.x.max])), [[from, to], [from, to], [from, to]]);
const width = async () => { const [a, b] = await range(); return b - a; };
await onPlot(0.5, 40);
await page.mouse.wheel(0, -100);
await until((wide) => { const [a, b] = takt.plots.shown(); return b - a < wide; }, to - from);
assert.ok(Math.abs((await width()) / (to - from) - 0.8) < 1e-6);
await page.locator('.plot').first().focus();
await page.keyboard.press('-');
assert.ok(Math.abs((await width()) / (to - from) - 1) < 1e-6);
const [start1] = await range();
await page.keyboard.press('ArrowLeft');
assert.ok(Math.abs((start1 - (await range())[0]) / (to - from) - 0.1) < 1e-6);
await page.mouse.dblclick(box.x + 0.5 * box.width, box.y + 40);
await until(() => takt.plots.span === null);

stage('live again');
await page.click('#live');
assert.ok(await page.locator('#past').isHidden());
await until(() => takt.lower.past.shown === null && takt.lower.state === takt.last.state);
assert.equal(await stop(recorder), 0, recorder.text);
// A click on a curve shows that time. The cell stands, so that the axis does not move on under the pointer.
takt('pause');
await until((time) => takt.last.state.time === time, takt('state').time);
await drawn();
await point(page, async () => { box = await over.first().boundingBox(); await page.mouse.click(box.x + 0.5 * box.width, box.y + 40); }, () => takt.lower.past.shown !== null);
// Shown is the newest instant at that time that the page has; on a busy machine they are far apart.
const [clicked, after] = await ask(() => {
  const {states, shown} = takt.lower.past, at = states.frames.findIndex(({time}) => time === shown.state.time);
  return [shown.state.time, states.frames[at + 1]?.time ?? Infinity];
}), all = await range(), middle = (all[0] + all[1]) / 2, near = 0.02 * (all[1] - all[0]);
assert.ok(clicked <= middle + near && after > middle - near, `${clicked} to ${after} of ${all}`);
await page.locator('#cell').focus();
await page.keyboard.press('l');
assert.equal(await ask(() => takt.lower.past.shown), null);

stage('the witness');
const lines = exported('seen.mcap'), states = new Map(lines.filter(({topic}) => topic === '/web_test/state').map(({sample}) => [sample.step, sample]));
const seen = instants.filter(({shown}) => states.has(shown.step));
assert.ok(seen.length > 0, `the recorder has one of the steps ${instants.map(({shown}) => shown.step)}`);
for (const {shown, components, place, joints, inspected} of seen) {
  const was = states.get(shown.step);
  assert.equal(shown.time, was.time);
  components.forEach((name, i) => assert.deepEqual(shown.components[i].position, was.components[name].position));
  ['x', 'y', 'z'].map((axis) => was.components.P.position[axis]).forEach((value, i) => {
    assert.ok(Math.abs(value - place[i]) < 1e-9);
    assert.ok(!inspected || Math.abs(1000 * value - inspected[i]) < 0.0051, `${inspected} mm`);
  });
  for (const [name, angle] of joints) assert.ok(Math.abs(was.robots.Robot1.position[name] - angle) < 1e-9, name);
}
// Pace was set three times: one row of the list, with the count, and one mark of the timeline.
await until(() => /^[\d.]+3 × The pace is now realtime, factor 1\.3/.test([...document.querySelectorAll('#events li')].map(({textContent}) => textContent).find((text) => text.includes('The pace')) ?? ''));
assert.equal(await ask(() => takt.lower.events.all.filter(({code}) => code === 'pace_changed').length), 3);

stage('files');
const [csv] = await Promise.all([page.waitForEvent('download'), page.locator('.plot').first().locator('button', {hasText: 'csv'}).click()]);
assert.match(csv.suggestedFilename(), /^takt_state\.robots\.Robot1.*\.csv$/);
const [head, ...rows] = readFileSync(await csv.path(), 'utf8').trim().split('\n');
assert.equal(head, `time [s],${joint('shoulder_pan')} [rad],${joint('shoulder_lift')} [rad],${joint('wrist_1')} [rad],${joint('shoulder_lift', 'velocity')} [rad/s]`);
const byTime = new Map([...states.values()].map((sample) => [sample.time, sample.robots.Robot1]));
let common = 0;
for (const row of rows) {
  const [time, pan, lift, wrist, velocity] = row.split(',').map(Number), robot = byTime.get(time);
  if (!robot) continue;
  ++common;
  assert.deepEqual([pan, lift, wrist, velocity], [robot.position.shoulder_pan_joint, robot.position.shoulder_lift_joint, robot.position.wrist_1_joint, robot.velocity.shoulder_lift_joint], `at ${time} s`);
}
assert.ok(common > 20, `${common} times of ${rows.length} are in the recording too`);
const [svg] = await Promise.all([page.waitForEvent('download'), page.locator('.plot').first().locator('button', {hasText: 'svg'}).click()]);
const picture = readFileSync(await svg.path(), 'utf8');
assert.deepEqual(await ask((text) => { const made = new DOMParser().parseFromString(text, 'image/svg+xml'); return [made.querySelectorAll('parsererror').length, made.querySelectorAll('path[fill=none]').length]; }, picture), [0, 4]);
const [png] = await Promise.all([page.waitForEvent('download'), page.locator('.plot').first().locator('button', {hasText: 'png'}).click()]);
assert.equal(readFileSync(await png.path()).subarray(0, 8).toString('latin1'), '\x89PNG\r\n\x1a\n');
assert.deepEqual(problems, []);
await page.context().close();
await stop(controller);
await stop(bridge);
await stop(running);

stage('a recording');
const player = await view(0, 'seen.mcap');
const film = await visit(browser, player.url, {width: 1400, height: 900});
await coarse(film.ask);
// It plays since it was opened. From its beginning again, with nothing remembered, so that the page has its first seconds alone.
await film.until(() => !document.querySelector('#playback').hidden && takt.plots.plots.length === 2);
const told = (request, args = {}) => film.ask(([name, values]) => takt.link.call(name, values), [request, args]);
await told('set_state', {state: 'paused'});
await told('seek', {position: 0});
await film.until(() => takt.last.playback.position === 0 && !takt.last.playback.playing);
await film.ask(() => takt.plots.clear());
const curve = () => film.ask(() => [...takt.plots.numbers(takt.plots.names()[0]).x]);
await film.page.click('#play');
await film.until(() => takt.plots.numbers(takt.plots.names()[0]).x.length > 10);
await film.page.click('#pause');
await film.until(() => takt.last.playback.playing === false);
const had = await curve(), at1 = await film.ask(() => takt.last.playback.position);
// A click on a curve leads there.
await film.ask(() => { takt.last.state = {time: -1}; });
const [wanted, wide] = await film.ask(() => { const [a, b] = takt.plots.shown(); return [(a + b) / 2, b - a]; });
await point(film.page, async () => { const plot = await film.page.locator('.plot .u-over').first().boundingBox(); await film.page.mouse.click(plot.x + 0.5 * plot.width, plot.y + 30); },
  ([time, most]) => Math.abs(takt.last.state.time - time) < most, [wanted, 0.05 * wide + 0.02]);
assert.ok((await curve()).length >= had.length, 'the curve stays where the recording goes back');
// Another place, beyond what was played: the line has a gap up to there.
const length = await film.ask(() => takt.last.playback.duration), beyond = (at1 + length) / 2 / length;
assert.ok(at1 < 0.8 * length, `paused at ${at1} of ${length} s`);
await slide(film.page, beyond);
await film.until((part) => takt.last.playback.position > (part - 0.01) * takt.last.playback.duration, beyond);
await film.until((last) => [...takt.plots.tracks.get('state').breaks].some((time) => time > last), had.at(-1));
// The events of all of it are there from the start: their marks say what they are, and lead there.
const recorded = lines.filter(({topic}) => topic === '/web_test/events').map(({sample}) => sample), paced = recorded.filter(({code}) => code === 'pace_changed');
await film.until((count) => takt.lower.events.all.length === count, recorded.length);
assert.equal(paced.length, 3);
const overMark = async () => {
  const at = await film.ask((time) => {
    const {timeline, events} = takt.lower, box = document.querySelector('#position').getBoundingClientRect();
    return [box.left + timeline.place(timeline.eventTime(events.all.find((event) => event.code === 'pace_changed' && event.time === time))), box.top + box.height / 2];
  }, paced[2].time);
  await film.page.mouse.move(at[0] + 1, at[1]);
  await film.page.mouse.move(...at);
};
await point(film.page, overMark, () => !document.querySelector('#marks').hidden);
assert.match(await film.page.locator('#marks').textContent(), /The pace is now realtime, factor 1\.[123]/);
await film.page.locator('#events button', {hasText: '3 × The pace'}).click();
await film.until((time) => Math.abs(takt.last.state.time - time) < 0.05, paced[2].time);
assert.deepEqual(film.problems, []);
await browser.close();
await stop(player.child);
console.log(`curves, history and recording; ${common} rows of a CSV file are those of DDS`);
process.exit(0);
