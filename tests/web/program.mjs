// The programs of the robots on the page, by mouse and by keys: their text with the line that runs, and their steps as bars of the
// timeline, of a running cell and of a recording. What a recorder on DDS has of the steps is the witness.
import {strict as assert} from 'node:assert';
import {execFileSync} from 'node:child_process';
import {existsSync, readFileSync, statSync} from 'node:fs';
import {findings} from './axe.mjs';
import {chromium, executable, point, visit} from './browser.mjs';
import {patient, program, server, start, stop, takt, view} from './processes.mjs';

const browser = await chromium.launch(executable());
const begun = Date.now();
const stage = (what) => console.log(`${((Date.now() - begun) / 1000).toFixed(1)} s: ${what}`);
const shot = (page, name) => process.env.TAKT_SCREENSHOT && page.screenshot({path: process.env.TAKT_SCREENSHOT.replace('.png', `_${name}.png`)});
const text = readFileSync(program, 'utf8'), lineOf = (n) => text.split('\n')[n - 1];

stage('no program yet');
// The cell stands in the middle of the program, however seldom the page draws.
const running = await server('--paused', '--pause-at-end', '--set', 'duration_s=12.4');
const {child: bridge, url} = await view();
const {page, problems, until, ask} = await visit(browser, url, {width: 1400, height: 900});
await ask(() => takt.cell.renderer.setPixelRatio(0.1));
await page.locator('#cell').focus();
await page.keyboard.press('p');
await until(() => !document.querySelector('#program').hidden && document.querySelector('#program-none').getClientRects().length > 0);
await page.click('#program-close');
await until(() => document.querySelector('#program').hidden);

stage('a controller runs one');
const recorder = await start('takt', ['record', 'seen.mcap', ...patient]);
while (!existsSync('seen.mcap') || statSync('seen.mcap').size < 20000) await new Promise((resolve) => setTimeout(resolve, 20));
const controller = await start('takt-controller', [program, ...patient]);
await page.click('#read-program');
await until((wanted) => document.querySelector('#program-which').selectedOptions[0]?.textContent === wanted, 'block_assembly.lua: Robot1, Robot2 (takt-controller)');
await until((first) => document.querySelector('#program-text .cm-line')?.textContent === first, lineOf(1));
assert.equal(await ask(() => takt.lower.programs.robots.get('Robot1').text), text);
await page.click('#play');
await until(() => takt.last.status.state === 2 && takt.last.state.time > 12);
const {time: end, step: last} = takt('state');
await until((step) => takt.last.state.step === BigInt(step), last);

stage('the line that runs');
// The marked line has the call which the robot waits for.
await until(() => document.querySelectorAll('#program-text .cm-running').length > 0);
// Both of one instant: the controller may begin a step while the cell stands.
const {path, marked} = await ask(() => ({path: document.querySelector('#program-answer').textContent, marked: [...document.querySelectorAll('#program-text .cm-running')].map(({textContent}) => textContent)}));
const calls = [...path.matchAll(/(?:^|, )(\w+): (.*?)(?=, \w+: |$)/g)].map(([, robot, names]) => ({robot, names: names.split(' › ')}));
assert.ok(calls.length >= 1 && calls.length <= 2, path);
for (const {names} of calls) assert.ok(marked.some((line) => line.includes(names.at(-1))), `${names.at(-1)} is in ${marked}`);
assert.deepEqual(await findings(page), [], 'axe-core');
await shot(page, 'program');
await page.locator('#cell').focus();
await page.keyboard.press('p');
await until(() => document.querySelector('#program').hidden);

stage('bars');
const bars = () => ask(() => takt.lower.timeline.drawnBars.map(({robot, step: {name, begin, end, line}}) => ({robot, name, begin, end, line})));
await until(() => takt.lower.timeline.drawnBars.length >= 2);
const shown = await bars();
for (const {line, name} of shown) assert.ok(lineOf(line).includes(name), `line ${line}: ${name}`);
// A bar says what it is, and a click on it shows the time of its beginning.
const chosen = shown.find(({end: to}) => to > 0) ?? shown[0];
const onBar = async () => {
  const [x, y] = await ask(({robot, begin}) => {
    const bar = takt.lower.timeline.drawnBars.find((one) => one.robot === robot && one.step.begin === begin), box = document.querySelector('#timeline canvas').getBoundingClientRect();
    return [box.left + (bar.a + bar.b) / 2, box.top + (bar.top + bar.bottom) / 2];
  }, chosen);
  await page.mouse.move(x + 1, y);
  await page.mouse.move(x, y);
};
await point(page, onBar, () => !document.querySelector('#marks').hidden);
assert.ok((await page.locator('#marks').textContent()).startsWith(`${chosen.robot}: ${chosen.name}`));
await point(page, async () => { await onBar(); await page.mouse.down(); await page.mouse.up(); }, ({begin}) => takt.lower.past.shown && takt.lower.state.time === takt.lower.past.states.frame(begin).time, chosen);
// By keys: the next and the previous beginning of a step.
const slider = page.locator('#position'), drawn = () => until(() => takt.lower.timeline.at === (takt.lower.past.shown ? takt.lower.state.time : null));
await drawn();
// The instant shown may be a little ahead of that beginning: the key goes on to the next one.
const begins = [...new Set(shown.map(({begin}) => begin))].sort((a, b) => a - b), next = begins.find((begin) => begin > chosen.begin + 1e-6);
assert.ok(next < end, `a step begins after ${chosen.begin} s`);
await slider.press('Shift+PageUp');
await until((time) => takt.lower.past.shown && takt.lower.state.time === takt.lower.past.states.frame(time).time, next);
// Keys visit each beginning once, also those between two instants that the page has.
await page.click('#live');
await drawn();
const visited = await ask(() => {
  const {timeline, past} = takt.lower, slider = document.querySelector('#position'), times = [], wanted = [...new Set(timeline.bars.flatMap(({steps}) => steps.map(({begin}) => begin)))].length;
  for (let n = 0; n <= wanted; ++n) {
    slider.dispatchEvent(new KeyboardEvent('keydown', {key: 'PageDown', shiftKey: true}));
    takt.lower.draw();
    if (timeline.jumped) times.push(timeline.jumped.time);
  }
  return {times, wanted, shown: Boolean(past.shown)};
});
assert.equal(new Set(visited.times).size, visited.wanted, JSON.stringify(visited));
await page.click('#live');
await drawn();
await slider.press('Shift+PageDown');
const newest = Math.max(...shown.map(({begin}) => begin).filter((begin) => begin < end - 1e-6));
await until((time) => takt.lower.past.shown && takt.lower.state.time === takt.lower.past.states.frame(time).time, newest);
await page.keyboard.press('l');
await shot(page, 'bars');

stage('the witness');
assert.equal(await stop(recorder), 0, recorder.text);
const lines = execFileSync(`${process.env.TAKT_BIN}/takt`, ['--json', 'export', 'seen.mcap'], {encoding: 'utf8', maxBuffer: 1 << 30}).trim().split('\n').map((line) => JSON.parse(line));
const witness = Object.fromEntries(['Robot1', 'Robot2'].map((robot) => [robot, lines.filter(({topic}) => topic === `/${process.env.TAKT_CELL}/${robot}/program_steps`).at(-1).sample]));
const named = Object.entries(witness).flatMap(([robot, {steps}]) => steps.filter((step) => step.named).map(({name, begin, end: to, line}) => ({robot, name, begin, end: to, line})));
assert.deepEqual(shown, named);
assert.equal(lines.find(({topic}) => topic.endsWith('/Robot2/program')).sample.text, text);
// A step that the controller began at the instant of the pause, after the page was looked at, is on the page too.
await page.locator('#cell').focus();
await page.keyboard.press('p');
const witnessed = Object.entries(witness).map(([robot, {steps}]) => ({robot, steps: steps.filter(({begin, end: to}) => begin <= end && (to < 0 || to > end))})).filter(({steps}) => steps.length);
await until((wanted) => document.querySelector('#program-answer').textContent === wanted, witnessed.map(({robot, steps}) => `${robot}: ${steps.map(({name}) => name).join(' › ')}`).join(', '));
for (const {steps} of witnessed) assert.ok((await lineOf(steps.at(-1).line)).includes(steps.at(-1).name));
// A reset ends them.
await stop(controller);
await page.click('#reset');
await until(() => takt.lower.timeline.bars.length === 0);
assert.deepEqual(problems, []);
await page.context().close();
await stop(bridge);
await stop(running);

stage('a recording');
const player = await view(0, 'seen.mcap');
const film = await visit(browser, player.url, {width: 1400, height: 900});
await film.until((many) => takt.lower.programs.bars(takt.last.state?.epoch).flatMap(({steps}) => steps).length === many, named.length);
await film.page.locator('#cell').focus();
await film.page.keyboard.press('p');
await film.until((first) => document.querySelector('#program-text .cm-line')?.textContent === first, lineOf(1));
assert.deepEqual(film.problems, []);
await browser.close();
await stop(player.child);
console.log(`${shown.length} steps of two robots as bars, as DDS has them; ${calls.length} of their lines marked`);
process.exit(0);
