// The page in use for a long time: ./dev soak page [--minutes N] [--seed N]. A random but repeatable order of what one does: it
// plays, pauses, steps, resets, scrubs and zooms the timeline, switches cells, levels, themes and sizes, selects, jogs, opens and
// closes panels, curves and texts; a second page is loaded again and again, a third one plays a recording. The run ends with 1 at the
// first error on a console, failed request or dead page, and where the first page, put back into the same state, has grown.
import {strict as assert} from 'node:assert';
import {cpSync} from 'node:fs';
import {chromium, executable, visit} from './browser.mjs';
import {program, sources, start, stop, takt, view} from './processes.mjs';

const given = process.argv.slice(2), valueOf = (name, otherwise) => Number(given.includes(name) ? given[given.indexOf(name) + 1] : otherwise);
const minutes = valueOf('--minutes', 60), first = valueOf('--seed', 1), CHECKS = 12;
// Growth between the first check after the warm-up and the last ones. A page keeps five minutes of a cell: they are forgotten before it
// is measured.
const MOST = {heap: 8e6, nodes: 500, listeners: 300, geometries: 20, textures: 4, documents: 2};
// Park and Miller 1988.
let seed = first;
const random = () => (seed = (48271 * seed) % 2147483647) / 2147483647;
const pick = (list) => list[Math.floor(random() * list.length)];

cpSync(`${sources}/config`, 'config', {recursive: true});
const server = await start('takt-server', ['config/scenarios/block_assembly.yaml', '--cell', process.env.TAKT_CELL, '--snapshots', 'snapshots', '--recordings', 'recordings', '--scenarios', 'config/scenarios', '--edit']);
const {child: bridge, url} = await view();
takt('play');
await (await start('takt', ['record', 'run.mcap', '--duration', '12'])).ended;
takt('pause');
const player = await view(0, 'run.mcap');
const browser = await chromium.launch(executable());
const problems = [], done = [], FRAME_MS = 250;  // three pages share the processor that draws
const watch = async (name, at, size) => {
  const seen = await visit(browser, at, size, {prepare: async (page) => {
    await page.addInitScript((ms) => { window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), ms); }, FRAME_MS);
    page.on('pageerror', (error) => problems.push(`${name}: ${error.stack}`));
    page.on('console', (message) => { if (message.type() === 'error') problems.push(`${name}: ${message.text()}`); });
    page.on('requestfailed', (request) => { if (request.failure()?.errorText !== 'net::ERR_ABORTED') problems.push(`${name}: ${request.url()}: ${request.failure()?.errorText}`); });
    page.on('crash', () => problems.push(`${name} is dead`));
  }});
  seen.page.setDefaultTimeout(20000);
  await seen.ask(() => { takt.cell.renderer.setPixelRatio(0.25); });
  return seen;
};
const long = await watch('page', url, {width: 1400, height: 900});
let other = await watch('page that is loaded again', url, {width: 390, height: 844});
const film = await watch('recording', player.url, {width: 900, height: 560});
const SIZES = [[1400, 900], [2560, 1440], [390, 844], [900, 560], [820, 1180]], CELLS = ['block_assembly', 'gear_on_shaft', 'chainsaw_motor', 'bev_rotor', 'nut_on_bolt', 'furnace'];
let controller = null;
// What is not there, or not to be pressed now, is passed over: the order stays that of the seed. What the page does not do in time
// is counted, by act.
const tardy = new Map();
const passOver = (error) => {
  if (!/Timeout|detached|Execution context/.test(error.message)) throw error;
  if (/Timeout/.test(error.message)) tardy.set(done.at(-1), (tardy.get(done.at(-1)) ?? 0) + 1);
};
const key = async ({page}, name) => { await page.keyboard.press('Escape'); await page.locator('#cell').focus(); await page.keyboard.press(name); };
const click = async ({page}, selector) => { const one = page.locator(selector).first(); if (await one.isVisible() && await one.isEnabled()) await one.click({timeout: 5000}).catch(passOver); };
const slide = ({page}) => page.locator('#position').evaluate((slider, part) => { slider.value = part; slider.dispatchEvent(new Event('input')); }, random());
const wheel = async ({page}, selector) => {
  const box = await page.locator(selector).first().boundingBox().catch(() => null);
  if (!box) return;
  await page.mouse.move(box.x + random() * box.width, box.y + 0.5 * box.height);
  await page.mouse.wheel(0, random() < 0.6 ? -100 : 100);
};
const KINEMATIC = ['furnace'];  // its gripper has no mass
const load = async (name) => {
  const level = KINEMATIC.includes(name) ? 1 : pick([1, 2]);
  await long.ask(([uri, level]) => takt.link.call('load_scenario', {uri, level_of_detail: level}), [`${name}.yaml`, level]);
  await long.until((wanted) => takt.last.description?.scenario === wanted, name);
};
const ACTS = {
  play: (at) => click(at, '#play'), pause: (at) => click(at, '#pause'), step: (at) => click(at, '#step'), reset: (at) => click(at, '#reset'), space: (at) => key(at, 'Space'),
  pace: (at) => at.ask((factor) => takt.link.call('set_pace', {pace: 'realtime', factor}).catch(() => {}), pick([0.5, 1, 2])),
  level: (at) => at.page.locator('#levels select').first().selectOption(pick(['1', '2', '3']), {timeout: 5000}).catch(passOver),
  scrub: slide, scrubs: async (at) => { for (let n = 0; n < 5; ++n) await slide(at); }, live: (at) => key(at, 'l'), event: (at) => click(at, '#events button'),
  'timeline by wheel': (at) => wheel(at, '#timeline'), 'timeline by key': async (at) => { if (await at.page.locator('#position').isVisible()) await at.page.locator('#position').press(pick(['+', '-', '0', 'Shift+ArrowLeft', 'PageUp', 'Shift+PageDown', 'ArrowLeft'])); },
  select: (at) => at.ask((part) => { const {components, robots, grippers, devices} = takt.last.description, all = [['component', components], ['robot', robots], ['gripper', grippers], ['device', devices ?? []]].flatMap(([kind, list]) => list.map(({name}) => ({kind, name}))); takt.select(all[Math.floor(part * all.length)]); }, random()),
  jog: (at) => click(at, '#selection button.jog'), explain: async ({page}) => { const one = page.locator('#selection button', {hasText: /^explain$/}); if (await one.isVisible()) await one.click({timeout: 5000}).catch(passOver); }, 'select nothing': (at) => key(at, 'Escape'),
  camera: (at) => key(at, pick(['1', '2', '3', '4', 'o', 'f', 'z', 'ArrowLeft', 'ArrowUp', '+', '-'])), 'pick in 3D': async ({page}) => { const box = await page.locator('#cell').boundingBox(); await page.mouse.click(box.x + random() * box.width, box.y + (0.2 + 0.7 * random()) * box.height); },
  theme: (at) => key(at, 'd'), panels: (at) => key(at, pick(['t', 'i', 'b'])), drawn: (at) => key(at, pick(['c', 'u', 'e', 'a', 'k'])), size: ({page}) => { const [width, height] = pick(SIZES); return page.setViewportSize({width, height}); },
  curve: (at) => at.ask((part) => { const names = [...takt.lower.tree.names.keys()]; if (names.length) takt.lower.add(names[Math.floor(part * names.length)], part < 0.3); }, random()), 'take a curve away': (at) => at.ask(() => { const {plots} = takt; if (plots.plots.length > 1) plots.close(plots.plots.at(-1)); }), 'curve by wheel': (at) => wheel(at, '.plot .u-over'),
  search: async ({page}) => { if (await page.locator('#signal').isVisible()) { await page.fill('#signal', pick(['P', 'velocity', 'force z', 'power', ''])); } }, find: async ({page}) => { if (await page.locator('#find').isVisible()) await page.fill('#find', pick(['R', 'P', ''])); },
  pressure: (at) => at.ask((value) => { const select = document.querySelector('#pressure'); select.value = value; select.onchange(); }, pick(['', '*'])), section: (at) => at.ask(([axis, place]) => { const select = document.querySelector('#section'); select.value = axis; document.querySelector('#cut').value = place; select.onchange(); }, [pick(['', 'x', 'y', 'z']), random() - 0.5]),
  editor: async (at) => { await key(at, 'y'); await at.page.waitForTimeout(300); if (random() < 0.7) await click(at, '#editor-close'); }, program: async (at) => { await key(at, 'p'); if (random() < 0.7) await click(at, '#program-close'); }, menu: async (at) => { await key(at, 'n'); await at.page.waitForTimeout(500); await at.page.keyboard.press('Escape'); }, keys: async (at) => { await key(at, '?'); await at.page.waitForTimeout(300); await at.page.keyboard.press('Escape'); },
  handles: async (at) => { await key(at, pick(['g', 'h'])); await at.page.keyboard.press('ArrowRight'); }, 'save a snapshot': (at) => at.ask(() => takt.link.call('save_snapshot', {name: 'soak'}).catch(() => {})), 'restore it': (at) => at.ask(() => takt.link.call('restore_snapshot', {name: 'soak'}).catch(() => {})), measure: async (at) => { await key(at, 'm'); await at.page.keyboard.press('Enter'); await at.page.keyboard.press('m'); },
};
const WATCHING = Object.keys(ACTS).filter((name) => !['pace', 'level', 'reset', 'restore it', 'save a snapshot', 'handles', 'jog'].includes(name));

// The page as it is opened, with the block assembly: what it weighs then.
async function weigh() {
  const {page, ask, until} = long;
  for (let n = 0; n < 3; ++n) await page.keyboard.press('Escape');
  await load('block_assembly');
  takt('pause');
  await page.setViewportSize({width: 1400, height: 900});
  await ask(() => {
    for (const id of ['editor', 'program']) if (!document.querySelector(`#${id}`).hidden) document.querySelector(`#${id}-close`).click();
    for (const [id, value] of [['pressure', ''], ['section', ''], ['follow', '']]) Object.assign(document.querySelector(`#${id}`), {value}).onchange();
    for (const id of ['signal', 'find']) Object.assign(document.querySelector(`#${id}`), {value: ''}).oninput();
    takt.lower.past.clear();
    takt.lower.events.clear();
    takt.lower.eventful = true;
    while (takt.plots.plots.length) takt.plots.close(takt.plots.plots[0]);
    for (const name of ['state.components.P.position.z', 'state.components.P.position.x']) takt.plots.add(name);
    takt.lower.timeline.fit();
    takt.select(null);
    takt.eye.past.length = 0;
  });
  takt('step', '5');
  await until(() => takt.cell.settled && takt.last.status?.state === 2);
  await page.waitForTimeout(2000);
  const cdp = await page.context().newCDPSession(page);
  for (let n = 0; n < 3; ++n) await cdp.send('HeapProfiler.collectGarbage');
  const {usedSize: heap} = await cdp.send('Runtime.getHeapUsage'), {documents, nodes, jsEventListeners: listeners} = await cdp.send('Memory.getDOMCounters');
  await cdp.detach();
  return {heap, nodes, listeners, documents, ...await ask(() => takt.cell.renderer.info.memory)};
}

const begun = Date.now(), passed = () => (Date.now() - begun) / 60000, weights = [];
const failed = (what) => { console.log(`failed after ${passed().toFixed(1)} min and ${done.length} acts of seed ${first}: ${what}\nthe last acts: ${done.slice(-20).join(', ')}`); process.exit(1); };
let acts = 0, checks = 0, cells = 0;
console.log('minutes     acts    heap, MB   nodes  listeners  documents  geometries  textures');
for (let next = 0; ; ) {
  if (passed() >= next || passed() >= minutes) {
    const weight = await weigh();
    weights.push(weight);
    console.log([passed().toFixed(1).padStart(7), String(acts).padStart(7), (weight.heap / 1e6).toFixed(1).padStart(10), String(weight.nodes).padStart(7), String(weight.listeners).padStart(10), String(weight.documents).padStart(10), String(weight.geometries).padStart(11), String(weight.textures).padStart(9)].join(' '));
    next = ++checks * minutes / CHECKS;
    if (passed() >= minutes) break;
  }
  // Another cell and another visit come rarely.
  const draw = random();
  if (draw < 0.02) { const name = pick(CELLS); done.push(`load ${name}`); await load(name); ++cells; }
  else if (draw < 0.04) { done.push('load the page again'); await other.page.reload({timeout: 300000}); await other.until(() => takt.last.state && takt.cell.frames > 0); await other.ask(() => { takt.cell.renderer.setPixelRatio(0.25); }); }
  else if (draw < 0.05) {
    done.push('controller');
    if (controller) { const one = controller; controller = null; one.kill('SIGKILL'); await one.ended; } else if (await long.ask(() => takt.last.description?.scenario === 'block_assembly')) { controller = await start('takt-controller', [program, '--start', '--timeout', '60']).catch(() => null); controller?.ended.then(() => {}); }
  } else {
    const [name, at] = random() < 0.6 ? ['', long] : random() < 0.5 ? ['again: ', other] : ['film: ', film], act = at === film ? pick(WATCHING) : pick(Object.keys(ACTS));
    done.push(name + act);
    await ACTS[act](at).catch(passOver).catch((error) => failed(`${act}: ${error.stack}`));
  }
  ++acts;
  if (problems.length) failed(problems.join('\n'));
  if (bridge.exitCode !== null || server.exitCode !== null || player.child.exitCode !== null) failed('a program of takt has ended');
}
// The warm-up ends with the second check; of the last three the least counts, since garbage is collected as the browser likes.
const base = weights[Math.min(2, weights.length - 1)], late = weights.slice(Math.max(weights.length - 3, Math.min(2, weights.length - 1)));
for (const [what, most] of Object.entries(MOST)) {
  const grown = Math.min(...late.map((one) => one[what])) - base[what];
  if (grown > most) failed(`${what} grew by ${grown}, from ${base[what]} (at most ${most})`);
}
for (const one of [long, other, film]) assert.deepEqual(one.problems, []);
await browser.close();
if (controller) controller.kill('SIGKILL');
await stop(player.child);
await stop(bridge);
await stop(server);
console.log(`${passed().toFixed(0)} minutes, ${acts} acts of seed ${first}, ${cells} cells loaded: no error on a console, no growth; ${[...tardy.values()].reduce((sum, count) => sum + count, 0)} acts came too late${tardy.size ? `: ${[...tardy].map(([act, count]) => `${count} ${act}`).join(', ')}` : ''}`);
process.exit(0);
