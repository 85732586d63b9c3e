// Every function of the page once by mouse and once by key; what acts on the cell has the state on DDS as its witness. Every
// button, input and choice of the page belongs to one of them. A native list of choices opens outside of the page: for it
// selectOption() stands for the mouse.
import {strict as assert} from 'node:assert';
import {cpSync, existsSync, mkdirSync, readFileSync, readdirSync} from 'node:fs';
import {chromium, executable, visit} from './browser.mjs';
import {patient, program, sources, start, stop, takt, view} from './processes.mjs';

const browser = await chromium.launch(executable());
cpSync(`${sources}/config`, 'config', {recursive: true});
const running = await start('takt-server', ['config/scenarios/block_assembly.yaml', '--cell', process.env.TAKT_CELL, '--paused', '--snapshots', 'snapshots', '--recordings', 'recordings', '--scenarios', 'config/scenarios', '--edit']);
const {child: bridge, url} = await view();
const {page, problems, until, ask} = await visit(browser, url, {width: 1400, height: 900});
await ask(() => takt.cell.renderer.setPixelRatio(0.1));
const begun = Date.now(), used = new Set();
const stage = (what) => console.log(`${((Date.now() - begun) / 1000).toFixed(1)} s: ${what}`);
const witness = async (read, wanted, what) => {
  for (let i = 0; ; ++i) {
    const found = read();
    if (wanted(found)) return found;
    assert.ok(i < 600, `${what}: ${JSON.stringify(found)}`);
    await new Promise((done) => setTimeout(done, 100));
  }
};
const key = async (name, on = '#cell') => { await page.locator(on).focus(); await page.keyboard.press(name); };
const click = (id) => page.click(`#${id}`);
// `of`: the controls that belong to it. mouse(), key(): do it; shows(turn): resolves when it has had its effect, 0 by mouse and 1 by
// key. Both are done on the state that the one before left.
async function both(what, of, {mouse, key: byKey, shows}) {
  for (const id of [of].flat()) used.add(id);
  if (process.env.TAKT_VERBOSE) console.log(what);
  for (const [turn, act] of [mouse, byKey].entries()) {
    try {
      await act();
      await shows(turn);
    } catch (error) { throw new Error(`${what}, by ${turn ? 'key' : 'mouse'}: ${error.stack}`); }
  }
}
// A switch of the page: by mouse, by its key, and back to what it was.
const toggled = (what, id, name, read) => {
  let was;
  return both(what, id, {mouse: async () => { was = await ask(read); await click(id); }, key: () => key(name), shows: (turn) => until(([wanted, source]) => String((0, eval)(`(${source})`)()) === wanted, [String(turn ? was : !was), String(read)])});
};
const status = () => takt('status');

stage('transport');
await both('run', 'play', {mouse: () => click('play'), key: async () => { takt('pause'); await until(() => takt.last.status.state === 2); await key('Space'); }, shows: () => witness(status, ({state}) => state === 'playing', 'running')});
await both('pause', 'pause', {mouse: () => click('pause'), key: async () => { takt('play'); await until(() => takt.last.status.state === 1); await key('Space'); }, shows: () => witness(status, ({state}) => state === 'paused', 'paused')});
let from;
const steps = {mouse: async () => { from = status().step; await page.fill('#steps', '7'); await click('step'); }, key: async () => { from = status().step; await key('.'); }, shows: () => witness(status, ({step}) => step === from + 7, 'seven steps')};
await both('steps', ['step', 'steps'], steps);
await both('reset', 'reset', {mouse: async () => { from = takt('state').epoch; await click('reset'); }, key: async () => { from = takt('state').epoch; await key('Shift+R'); }, shows: () => witness(() => takt('state'), ({epoch, time}) => epoch > from && time === 0, 'reset')});
await both('pace', 'pace', {mouse: () => page.selectOption('#pace', 'lockstep').catch(() => page.selectOption('#pace', {index: 1})), key: async () => { await page.locator('#pace').focus(); await page.keyboard.press('Home'); }, shows: async (turn) => {
  const wanted = await page.locator('#pace').inputValue();
  await witness(status, ({pace}) => pace === wanted, `pace ${wanted}`);
  if (turn) await page.selectOption('#pace', 'realtime');
}});
await witness(status, ({pace}) => pace === 'realtime', 'real time');
await both('pace factor', 'factor', {mouse: async () => { await page.fill('#factor', '2'); await click('name'); await page.locator('#factor').blur(); }, key: async () => { await page.fill('#factor', '1'); await page.locator('#factor').press('Enter'); }, shows: (turn) => witness(status, ({pace_factor: factor}) => factor === (turn ? 1 : 2), 'factor')});
await both('level of detail', 'levels', {mouse: () => page.selectOption('#levels select', '2'), key: async () => { await page.locator('#levels select').focus(); await page.keyboard.press('1'); }, shows: (turn) => witness(status, ({processes}) => Object.values(processes)[0].level_of_detail === (turn ? 1 : 2), 'level')});

stage('panels');
for (const [panel, name] of [['tree', 't'], ['inspector', 'i'], ['bottom', 'b']])
  await toggled(`fold ${panel}`, `fold-${panel}`, name, panel === 'tree' ? () => document.body.classList.contains('no-tree') : panel === 'inspector' ? () => document.body.classList.contains('no-inspector') : () => document.body.classList.contains('no-bottom'));
await toggled('theme', 'theme', 'd', () => document.documentElement.classList.contains('wa-dark'));
await both('list of keys', 'help', {mouse: () => click('help'), key: () => key('?'), shows: async () => { await until(() => document.querySelector('#keys').open); await page.keyboard.press('Escape'); await until(() => !document.querySelector('#keys').open); }});
const tall = () => ask(() => document.querySelector('#bottom').offsetHeight);
await both('height of the lower panel', 'grip', {mouse: async () => {
  from = await tall();
  const box = await page.locator('#grip').boundingBox();
  await page.mouse.move(box.x + 300, box.y + 3);
  await page.mouse.down();
  await page.mouse.move(box.x + 300, box.y - 57, {steps: 3});
  await page.mouse.up();
}, key: async () => { from = await tall() - 60; for (let n = 0; n < 2; ++n) await page.locator('#grip').press('ArrowDown'); from -= 60; }, shows: (turn) => until(([was, by]) => Math.abs(document.querySelector('#bottom').offsetHeight - was - by) <= 4, turn ? [from, 60] : [from, 60])});

stage('the view');
const flown = () => until(() => takt.eye.flight === null);
const along = () => ask(() => { const {camera, orbit} = takt.cell, v = camera.position.clone().sub(orbit.target).normalize(); return [v.x, v.y, v.z]; });
// Each side twice: the second time it is the opposite one.
for (const [name, digit, side] of [['front', '2', [0, -1, 0]], ['right', '3', [1, 0, 0]], ['top', '4', [0, 0, 1]], ['iso', '1', [0.5373, 0.7164, 0.4442]]]) {
  const seen = async (sign) => { await flown(); const at = await along(); side.forEach((value, i) => assert.ok(Math.abs(at[i] - (name === 'iso' && i === 2 ? 1 : sign) * value) < 0.01, `${name}: ${at}`)); };
  await both(`view ${name}`, name, {mouse: async () => { await page.click(`[data-camera=${name}]`); await seen(1); await page.click(`[data-camera=${name}]`); }, key: async () => { await key(digit); await seen(1); await key(digit); }, shows: () => seen(-1)});
}
await key('1');
await flown();
const far = () => ask(() => takt.cell.camera.position.distanceTo(takt.cell.orbit.target));
await ask(() => takt.select({kind: 'component', name: 'P'}));
const whole = await far();
await both('fit', 'fit', {mouse: async () => { await click('fit'); await flown(); }, key: async () => { await ask(() => { takt.select(null); takt.eye.fit('iso', null, false); takt.select({kind: 'component', name: 'P'}); }); await key('f'); await flown(); }, shows: async () => assert.ok(await far() < 0.8 * whole, `${await far()} m of ${whole}`)});
await both('previous view', 'back', {mouse: async () => { await click('back'); await flown(); }, key: async () => { await key('f'); await flown(); await key('z'); await flown(); }, shows: async () => assert.ok(await far() > 0)});
await toggled('orthographic', 'orthographic', 'o', () => takt.cell.camera.isOrthographicCamera === true);
await both('measure', 'measure', {mouse: () => click('measure'), key: async () => { await key('m'); await key('m'); }, shows: () => until(() => document.querySelector('#measure').ariaPressed === 'true')});
await key('m');
await ask(() => { takt.select(null); takt.eye.fit('iso', null, false); });
const turnBy = {mouse: async () => {
  from = await along();
  const box = await page.locator('#cell').boundingBox();
  await page.mouse.move(box.x + 300, box.y + 250);
  await page.mouse.down();
  await page.mouse.move(box.x + 380, box.y + 250, {steps: 4});
  await page.mouse.up();
}, key: async () => { from = await along(); await key('ArrowLeft'); }, shows: async () => assert.ok(Math.hypot(...(await along()).map((value, i) => value - from[i])) > 0.02)};
await both('turn the view', [], turnBy);
await both('nearer', [], {mouse: async () => { from = await far(); await page.locator('#cell').hover(); await page.mouse.wheel(0, -300); }, key: async () => { from = await far(); await key('+'); }, shows: () => until((was) => takt.cell.camera.position.distanceTo(takt.cell.orbit.target) < 0.99 * was, from)});

stage('what is drawn');
await toggled('colour by state', 'by-state', 'c', () => takt.cell.options.byState);
await toggled('colour by force', 'by-force', 'u', () => takt.cell.options.byForce);
await toggled('edges', 'edges', 'e', () => takt.cell.options.edges);
await toggled('frames', 'frames', 'a', () => takt.cell.options.frames);
for (const [id, read] of [['forces', () => takt.cell.options.forces], ['contacts', () => takt.cell.options.contacts], ['holding', () => takt.cell.options.holding]]) {
  const was = await ask(read);
  await both(id, id, {mouse: () => click(id), key: async () => { await page.locator(`#${id}`).focus(); await page.keyboard.press('Space'); }, shows: async (turn) => assert.equal(await ask(read), turn ? was : !was)});
}
await both('arrows', 'scale', {mouse: async () => { await page.fill('#scale', '60'); await page.locator('#scale').blur(); }, key: async () => { await page.locator('#scale').focus(); await page.keyboard.press('ArrowDown'); await page.keyboard.press('Tab'); }, shows: (turn) => until((wanted) => Math.abs(takt.cell.options.metresPerNewton - wanted) < 0.0011, turn ? 0.0591 : 0.06)});
await both('follow', 'follow', {mouse: () => page.selectOption('#follow', 'P'), key: async () => { await page.locator('#follow').focus(); await page.keyboard.press('Home'); }, shows: (turn) => until((wanted) => takt.cell.options.follow === wanted, turn ? '' : 'P')});
await both('section', 'section', {mouse: () => page.selectOption('#section', 'x'), key: async () => { await page.locator('#section').focus(); await page.keyboard.press('z'); }, shows: (turn) => until((wanted) => takt.cell.section === wanted, turn ? 'z' : 'x')});
await both('place of the section', 'cut', {mouse: async () => { from = await ask(() => takt.cell.cut); const box = await page.locator('#cut').boundingBox(); await page.mouse.click(box.x + 0.75 * box.width, box.y + box.height / 2); }, key: async () => { from = await ask(() => takt.cell.cut); await page.locator('#cut').press('ArrowLeft'); }, shows: () => until((was) => takt.cell.cut !== was, from)});
await page.selectOption('#section', '');
const files = async (act) => (await Promise.all([page.waitForEvent('download'), act()]))[0];
let file;
await both('screenshot', 'screenshot', {mouse: async () => { file = await files(() => click('screenshot')); }, key: async () => { file = await files(() => page.locator('#screenshot').press('Enter')); }, shows: () => assert.match(file.suggestedFilename(), /\.png$/)});
const told = () => until(() => /address/.test(document.querySelector('#answer').textContent));
await both('link', 'link', {mouse: () => click('link'), key: async () => { await ask(() => { document.querySelector('#answer').textContent = ''; }); await page.locator('#link').press('Enter'); }, shows: told});

stage('selection');
const chosen = (name) => until((wanted) => (takt.selected()?.name ?? null) === wanted, name);
await both('select in the tree', 'nodes', {mouse: () => page.click('wa-tree-item[data-name="P"]'), key: async () => { await page.locator('wa-tree-item[data-name="P"]').focus(); await page.keyboard.press('ArrowDown'); await page.keyboard.press('Enter'); }, shows: async (turn) => (turn ? until(() => takt.selected() && takt.selected().name !== 'P') : chosen('P'))});
await both('select nothing', [], {mouse: async () => { const box = await page.locator('#cell').boundingBox(); await page.mouse.click(box.x + box.width - 8, box.y + box.height / 2); }, key: () => key('Escape'), shows: () => chosen(null)});
await both('find', 'find', {mouse: async () => { await click('find'); await page.keyboard.type('Robot1'); }, key: async () => { await page.fill('#find', ''); await key('/'); await page.keyboard.type('Robot1'); }, shows: () => until(() => [...document.querySelectorAll('#nodes wa-tree-item[data-name]')].filter(({hidden}) => !hidden).map(({dataset}) => dataset.name).join() === 'Robot1')});
await page.fill('#find', '');

stage('a Part by hand');
const place = (name = 'C') => { const {x, y, z} = takt('state').components[name].position; return [x, y, z]; };
await ask(() => takt.select({kind: 'component', name: 'C'}));
await both('move', 'move', {mouse: () => click('move'), key: async () => { await key('g'); await key('g'); }, shows: () => until(() => takt.mover.handles.object?.name === 'C' && takt.mover.mode === 'translate')});
from = place();
await key('ArrowRight');
await witness(() => place(), ([x]) => Math.abs(x - from[0] - 0.001) < 1e-9, '1 mm by key');
await both('turn', 'turn', {mouse: () => click('turn'), key: async () => { await key('h'); await key('h'); }, shows: () => until(() => takt.mover.mode === 'rotate')});
await key('h');
const put = page.locator('#selection button', {hasText: /^put$/}), field = page.locator('#selection input[aria-label="x in mm"]');
const target = () => 1000 * from[0] + 4;
await both('put', [], {mouse: async () => { await field.fill(target().toFixed(3)); await put.click(); }, key: async () => { from = place(); await field.fill(target().toFixed(3)); await put.press('Enter'); }, shows: () => witness(() => place(), ([x]) => Math.abs(1000 * x - target()) < 0.01, 'put')});
const explained = page.locator('#selection button', {hasText: /^explain$/}), says = () => until(() => /C/.test([...document.querySelectorAll('#selection p')].at(-1).textContent));
await both('explain', [], {mouse: () => explained.click(), key: async () => { await ask(() => { [...document.querySelectorAll('#selection p')].at(-1).textContent = ''; }); await explained.press('Enter'); }, shows: says});
await both('stop', 'stop', {mouse: () => click('stop'), key: async () => { takt('pause'); await witness(status, ({state}) => state === 'paused', 'paused'); await key('s'); }, shows: () => witness(status, ({state}) => state === 'stopped', 'stopped')});
await ask(() => takt.select({kind: 'component', name: 'C'}));
const free = (text) => until((wanted) => [...document.querySelectorAll('#selection button')].some(({textContent, disabled}) => textContent === wanted && !disabled), text);
const command = (text) => page.locator('#selection button', {hasText: new RegExp(`^${text}$`)});
const parts = () => Object.keys(takt('state').components).filter((name) => name.startsWith('C_copy')).length;
let many = parts();
await free('copy');
await both('copy', [], {mouse: () => command('copy').click(), key: async () => { await ask(() => takt.select({kind: 'component', name: 'C'})); await free('copy'); await command('copy').press('Enter'); }, shows: (turn) => witness(parts, (count) => count === many + 1 + turn, 'copies')});
const spare = Object.keys(takt('state').components).filter((name) => name.startsWith('C_copy'));
await both('delete', [], {mouse: async () => { await until((name) => takt.last.description.components.some((one) => one.name === name), spare[0]); await ask((name) => takt.select({kind: 'component', name}), spare[0]); await free('delete'); await command('delete').click(); },
  key: async () => { await ask((name) => takt.select({kind: 'component', name}), spare[1]); await free('delete'); await command('delete').press('Enter'); }, shows: (turn) => witness(parts, (count) => count === many + 1 - turn, 'deleted')});

stage('robots and grippers');
await click('play');
await ask(() => takt.select({kind: 'robot', name: 'Robot1'}));
const joint = await ask(() => takt.last.description.robots[0].joints[0].name), angle = () => takt('state').robots.Robot1.position[joint];
const forth = page.locator(`#selection button[aria-label="${joint} forth"]`), jogs = async (act) => { await until((label) => { const one = document.querySelector(`#selection button[aria-label="${label}"]`); return !one.disabled && one.ariaBusy !== 'true'; }, `${joint} forth`); from = angle(); await act(); };
await both('jog a joint', [], {mouse: () => jogs(() => forth.click()), key: () => jogs(() => forth.press('Enter')), shows: () => witness(angle, (now) => Math.abs(now - from - 5 * Math.PI / 180) < 1e-3, 'jogged')});
const palm = await ask(() => takt.last.description.components[takt.last.description.grippers[0].palm].name), up = page.locator('#selection button[aria-label="z+: along z"]');
const lifts = async (act) => { await until(() => { const one = document.querySelector('#selection button[aria-label="z+: along z"]'); return !one.disabled && one.ariaBusy !== 'true'; }); from = place(palm); await act(); };
await both('jog the tool centre point', [], {mouse: () => lifts(() => up.click()), key: () => lifts(() => up.press('Enter')), shows: () => witness(() => place(palm), ([, , z]) => Math.abs(z - from[2] - 0.01) < 5e-4, 'lifted')});
await ask(() => takt.select({kind: 'gripper', name: 'Gripper1'}));
const gripper = () => takt('state').grippers.Gripper1;
await free('close');
await both('close a gripper', [], {mouse: () => command('close').click(), key: async () => { await command('open').press('Enter'); await witness(gripper, ({closed}) => !closed, 'open'); await command('close').press('Enter'); }, shows: () => witness(gripper, ({closed}) => closed, 'closed')});
await both('force a signal', [], {mouse: () => command('force open').click(), key: async () => { await free('release'); await command('release').press('Enter'); await witness(gripper, ({forced}) => !forced, 'released'); await command('force open').press('Enter'); }, shows: () => witness(gripper, ({forced}) => Boolean(forced), 'forced')});
await free('release');
await command('release').click();
await witness(gripper, ({forced}) => !forced, 'released');

stage('timeline');
await until(() => takt.lower.past.states.newest - takt.lower.past.states.first > 3);
await click('pause');
await until(() => takt.last.status.state === 2);
await until((step) => takt.last.state.step === BigInt(step) && takt.lower.timeline.newest === takt.last.state.time, takt('state').step);
const wide = () => ask(() => takt.lower.timeline.to - takt.lower.timeline.from);
const shown = (at) => until((wanted) => (wanted ? takt.lower.past.shown !== null : takt.lower.past.shown === null), at);
await both('another time', 'position', {mouse: async () => { const box = await page.locator('#position').boundingBox(); await page.mouse.click(box.x + 0.4 * box.width, box.y + box.height / 2); }, key: async () => { await key('l'); await shown(false); await page.locator('#position').press('ArrowLeft'); }, shows: () => shown(true)});
await both('live', 'live', {mouse: () => click('live'), key: async () => { await page.locator('#position').press('ArrowLeft'); await shown(true); await key('l'); }, shows: () => shown(false)});
const all = await wide();
const narrower = (factor) => until(([was, by]) => Math.abs((takt.lower.timeline.to - takt.lower.timeline.from) / was - by) < 0.01, [from, factor]);
await both('a shorter part', 'nearer', {mouse: async () => { from = await wide(); await click('nearer'); }, key: async () => { from = await wide(); await key('+', '#position'); }, shows: () => narrower(0.7)});
await both('a longer part', 'farther', {mouse: async () => { from = await wide(); await click('farther'); }, key: async () => { await key('+', '#position'); from = await wide(); await key('-', '#position'); }, shows: () => narrower(1 / 0.7)});
await both('all times', 'all-times', {mouse: () => click('all-times'), key: async () => { await key('+', '#position'); await key('0', '#position'); }, shows: () => until(() => !takt.lower.timeline.window.partial && document.querySelector('#all-times').disabled)});
// The wheel keeps the time below the pointer; a drag moves the part as far as the pointer goes.
const lane = await page.locator('#timeline').boundingBox(), timeBelow = (x) => ask((at) => takt.lower.timeline.timeAt(at), x - lane.x);
const pointer = Math.round(lane.x + 0.6 * lane.width);  // events have whole pixels
await page.mouse.move(pointer, lane.y + 25);
const below = await timeBelow(pointer);
await page.mouse.wheel(0, -100);
await until((was) => takt.lower.timeline.to - takt.lower.timeline.from < 0.8 * was, all);
assert.ok(Math.abs(await timeBelow(pointer) - below) < 1e-6, `${await timeBelow(pointer)} s below the pointer, ${below} before`);
await page.mouse.wheel(0, -100);
await until((was) => takt.lower.timeline.to - takt.lower.timeline.from < 0.55 * was, all);
const begins = () => ask(() => takt.lower.timeline.from), moved = {mouse: async () => {
  from = await begins();
  await page.mouse.move(lane.x + 0.5 * lane.width, lane.y + 5);
  await page.mouse.down();
  await page.mouse.move(lane.x + 0.6 * lane.width, lane.y + 5, {steps: 4});
  await page.mouse.up();
  from -= 0.1 * await wide();
}, key: async () => { await key('Shift+ArrowRight', '#position'); from = await begins() - 0.1 * await wide(); await key('Shift+ArrowLeft', '#position'); }, shows: () => until((wanted) => Math.abs(takt.lower.timeline.from - wanted) < 0.02, from)};
await both('move the part', [], moved);
assert.ok(!await ask(() => takt.lower.past.shown), 'a drag of the part shows no other time');
await page.locator('#timeline').dblclick({position: {x: 300, y: 5}});
await until(() => !takt.lower.timeline.window.partial);

stage('curves');
const names = () => ask(() => takt.plots.names().flat());
await both('a plot of its own', ['signal', 'add-plot'], {mouse: async () => { await page.fill('#signal', 'P position y'); await click('add-plot'); }, key: async () => { await page.fill('#signal', 'P position x'); await page.locator('#signal').press('Shift+Enter'); }, shows: async (turn) => assert.ok((await names()).includes(`state.components.P.position.${turn ? 'x' : 'y'}`), String(await names()))});
await both('take a plot away', [], {mouse: async () => { from = (await names()).length; await page.locator('.plot .close').last().click(); }, key: async () => { from = (await names()).length; await page.locator('.plot').last().press('Delete'); }, shows: async () => assert.equal((await names()).length, from - 1)});
const plot = page.locator('.plot .u-over').first(), span = () => ask(() => { const [a, b] = takt.plots.shown(); return b - a; });
await both('nearer in a plot', [], {mouse: async () => { from = await span(); await plot.hover(); await page.mouse.wheel(0, -100); }, key: async () => { from = await span(); await page.locator('.plot').first().press('+'); }, shows: () => until((was) => { const [a, b] = takt.plots.shown(); return Math.abs((b - a) / was - 0.8) < 1e-3; }, from)});
await both('all of a plot', [], {mouse: () => plot.dblclick(), key: async () => { await page.locator('.plot').first().press('+'); await page.locator('.plot').first().press('0'); }, shows: () => until(() => takt.plots.span === null)});
for (const kind of ['csv', 'png', 'svg']) {
  const button = page.locator('.plot').first().locator('button', {hasText: kind});
  await both(kind, [], {mouse: async () => { file = await files(() => button.click()); }, key: async () => { file = await files(() => button.press('Enter')); }, shows: () => assert.ok(file.suggestedFilename().endsWith(kind))});
}
await both('an event', 'events', {mouse: () => page.locator('#events button').last().click(), key: async () => { await page.keyboard.press('Escape'); await page.locator('#events button').last().press('Enter'); }, shows: () => until(() => takt.lower.past.shown !== null || /no memory/.test(document.querySelector('#answer').textContent))});
await key('l');

stage('programs');
const controller = await start('takt-controller', [program, ...patient]);
const open = (id) => until((which) => !document.querySelector(`#${which}`).hidden, id), shut = (id) => until((which) => document.querySelector(`#${which}`).hidden, id);
await both('programs', ['read-program', 'program-close', 'program-which', 'program-follow'], {mouse: () => click('read-program'), key: () => key('p'), shows: async (turn) => {
  await open('program');
  await until(() => document.querySelector('#program-which').selectedOptions.length > 0 && document.querySelectorAll('#program-text .cm-line').length > 5);
  if (turn) { await page.locator('#program-follow').press('Space'); assert.ok(!await page.locator('#program-follow').isChecked()); await page.locator('#program-close').press('Enter'); } else { await click('program-follow'); assert.ok(!await page.locator('#program-follow').isChecked()); await click('program-follow'); await click('program-close'); }
  await shut('program');
}});
await stop(controller);

stage('editor');
await both('editor', ['edit', 'editor-save', 'editor-run', 'editor-close'], {mouse: () => click('edit'), key: () => key('y'), shows: async (turn) => {
  await open('editor');
  await until(() => document.querySelectorAll('#editor-text .cm-line').length > 5);
  const note = `# ${turn ? 'by key' : 'by mouse'}`, written = () => witness(() => readFileSync('config/scenarios/block_assembly.yaml', 'utf8').trimEnd().split('\n').at(-1), (line) => line === note, 'saved');
  await page.locator('#editor .cm-content').press('Control+End');
  await page.keyboard.type(`\n${note}`);
  if (turn) await page.keyboard.press('Control+s'); else await click('editor-save');
  await written();
  from = await ask(() => takt.last.description.scenario_generation);
  if (turn) await page.keyboard.press('Control+Enter'); else await click('editor-run');
  await until((was) => takt.last.description.scenario_generation > was, from);
  if (turn) await page.locator('#editor-close').press('Enter'); else await click('editor-close');
  await shut('editor');
}});

stage('menu');
const listed = () => until(() => document.querySelector('#cell-menu').open && !document.querySelector('#save').disabled);
await both('menu', 'menu', {mouse: () => click('menu'), key: () => key('n'), shows: async (turn) => { await listed(); if (!turn) { await page.keyboard.press('Escape'); await until(() => !document.querySelector('#cell-menu').open); } }});
const answered = (words) => until((wanted) => document.querySelector('#menu-answer').textContent.includes(wanted), words);
await both('save a snapshot', ['snapshot-name', 'save'], {mouse: async () => { await page.fill('#snapshot-name', 'mouse'); await click('save'); }, key: async () => { await page.fill('#snapshot-name', 'key'); await page.locator('#snapshot-name').press('Enter'); }, shows: (turn) => until((name) => [...document.querySelectorAll('#snapshot-files button')].some(({textContent}) => textContent === name), turn ? 'key' : 'mouse')});
const restores = async (act) => { from = takt('state').epoch; await act(); }, restored = () => witness(() => takt('state').epoch, (epoch) => epoch > from, 'restored');
await both('restore a snapshot', [], {mouse: () => restores(() => page.locator('#snapshot-files button', {hasText: 'mouse'}).click()), key: () => restores(() => page.locator('#snapshot-files button', {hasText: 'key'}).press('Enter')), shows: restored});
await both('restore the newest one', 'restore-newest', {mouse: async () => { await ask(() => { document.querySelector('#menu-answer').textContent = ''; }); await click('restore-newest'); }, key: async () => { await ask(() => { document.querySelector('#menu-answer').textContent = ''; }); await page.locator('#restore-newest').press('Enter'); }, shows: () => until(() => document.querySelector('#menu-answer').textContent !== '')});
const logs = () => (existsSync('recordings') ? readdirSync('recordings') : []).join();
await both('record commands', ['recording-name', 'record', 'record-stop'], {mouse: async () => { await page.fill('#recording-name', 'mouse'); await click('record'); await witness(logs, (all) => all.includes('mouse'), 'recording'); await click('record-stop'); }, key: async () => { await page.fill('#recording-name', 'key'); await page.locator('#recording-name').press('Enter'); await witness(logs, (all) => all.includes('key'), 'recording'); await page.locator('#record-stop').press('Enter'); }, shows: () => answered('record')});
const generation = () => ask(() => takt.last.description.scenario_generation), loaded = (name) => until(([was, wanted]) => takt.last.description.scenario_generation > was && takt.last.description.scenario === wanted, [from, name]);
await both('load', ['scenario-file', 'load', 'load-level'], {mouse: async () => { from = await generation(); await page.fill('#scenario-file', 'gear_on_shaft.yaml'); await page.selectOption('#load-level', '3'); await click('load'); }, key: async () => { from = await generation(); await page.fill('#scenario-file', 'block_assembly.yaml'); await page.locator('#load-level').press('Home'); await page.locator('#scenario-file').press('Enter'); }, shows: async (turn) => {
  await loaded(turn ? 'block_assembly' : 'gear_on_shaft');
  if (turn) return;
  await witness(status, ({processes}) => Object.values(processes)[0].level_of_detail === 3, 'level 3');
  // Elements that press, where Parts stand on something.
  takt('pause');
  takt('step', '5');
  await until(() => takt.last.contacts?.contacts.length > 0);
  await page.keyboard.press('Escape');
  await until(() => !document.querySelector('#cell-menu').open);
  await both('elements of pressure', 'pressure', {mouse: () => page.selectOption('#pressure', '*'), key: async () => { await page.selectOption('#pressure', ''); await until(() => takt.cell.pressed.size === 0); await page.locator('#pressure').focus(); await page.keyboard.press('a'); }, shows: () => until(() => takt.cell.pressed.size > 0)});
  // The legend names the largest pressure of each pair, with its unit.
  await until(() => !document.querySelector('#pressures').hidden && /: [\d.]+ [kM]?Pa, \d+ elements/.test(document.querySelector('#pressures').textContent));
  await page.selectOption('#pressure', '');
  await key('n');
  await listed();
}});
await both('reload', 'reload', {mouse: async () => { from = await generation(); await click('reload'); }, key: async () => { from = await generation(); await page.locator('#reload').press('Enter'); }, shows: () => loaded('block_assembly')});
mkdirSync('config/scenarios/parts');
cpSync('config/meshes/C.obj', 'config/scenarios/parts/C.obj');
await page.fill('#part-file', 'parts');
await page.locator('#part-file').press('Tab');
await until(() => [...document.querySelectorAll('#part-files option')].some(({value}) => value.endsWith('/C.obj')));
const mesh = await ask(() => [...document.querySelectorAll('#part-files option')].find(({value}) => value.endsWith('/C.obj')).value);
await both('a Part of a mesh file', ['part-file', 'part-unit', 'part-name', 'part-mass', 'part-add'], {mouse: async () => { await page.fill('#part-file', mesh); await page.fill('#part-name', 'ByMouse'); await page.fill('#part-mass', '0.2'); await page.selectOption('#part-unit', '1'); await click('part-add'); }, key: async () => { await page.fill('#part-name', 'ByKey'); await page.locator('#part-unit').press('Home'); await page.locator('#part-mass').press('Enter'); }, shows: (turn) => witness(() => Object.keys(takt('state').components), (all) => all.includes(turn ? 'ByKey' : 'ByMouse'), 'added')});
await both('unload', 'unload', {mouse: () => click('unload'), key: async () => { await page.fill('#scenario-file', 'block_assembly.yaml'); await page.locator('#load').press('Enter'); await witness(status, ({state}) => state === 'stopped', 'loaded'); await page.locator('#unload').press('Enter'); }, shows: () => witness(status, ({state}) => state === 'no_scenario', 'unloaded')});
await page.keyboard.press('Escape');
await until(() => !document.querySelector('#cell-menu').open);
used.add('by-temperature');  // look.mjs has a cell with temperatures

stage('none is left out');
const controls = await ask(() => [...document.querySelectorAll('button[id], input[id], select[id], [data-camera], wa-tree[id]')].map(({id, dataset}) => id || dataset.camera));
assert.deepEqual(controls.filter((id) => !used.has(id) && id !== 'signals'), [], 'controls that no function has');
assert.ok(controls.length > 60, `${controls.length} controls`);

stage('observer');
const observer = await visit(browser, `${url}?observer`, {width: 1400, height: 900});
const refused = await observer.ask(() => [...document.querySelectorAll('#controls button, #controls input, #controls select')].map(({id, disabled, title}) => [id, disabled, title]));
for (const [id, disabled, title] of refused) assert.ok(disabled && title === 'Observers may look, not touch.', `${id}: ${disabled}, ${title}`);
await observer.page.locator('#cell').focus();
await observer.page.keyboard.press('Space');
await observer.until(() => document.querySelector('#answer').textContent === 'Observers may look, not touch.');
assert.deepEqual([...problems, ...observer.problems], []);
await browser.close();
await stop(bridge);
await stop(running);
console.log(`${controls.length} controls, each by mouse and by key`);
process.exit(0);
