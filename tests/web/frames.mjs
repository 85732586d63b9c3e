// Time of a frame of the page in software rendering, beside that of another page: ./dev bench view frames [--against COMMIT | none]
// [--cells NAME,...] [--frames N]. The other one is the page of that commit (by default the last before the page had panels),
// built here with the packages of this one; both show the same cell through the same takt view, from the same place, on as many
// pixels, and their frames are measured by turns in one run. Printed, not judged: it depends on the machine.
import {execFileSync} from 'node:child_process';
import {cpSync, existsSync, mkdirSync, readFileSync, symlinkSync, writeFileSync} from 'node:fs';
import {chromium, executable} from './browser.mjs';
import {sources, start, stop, takt, view} from './processes.mjs';

const BEFORE = '2f05aa74~1', SIZE = [900, 600];
const given = process.argv.slice(2), valueOf = (name, otherwise) => (given.includes(name) ? given[given.indexOf(name) + 1] : otherwise);
const against = valueOf('--against', BEFORE), frames = Number(valueOf('--frames', 40)), cells = valueOf('--cells', 'block_assembly,chainsaw_motor,bev_rotor').split(',');
const here = executable();

// The files of that commit's page, by the path that a browser asks for; null: it cannot be had.
function pageOf(commit) {
  if (commit === 'none') return null;
  const built = `${process.env.TAKT_BIN}/../client_lib/view/web`, folder = `${process.env.TAKT_WORK}/before`, git = (...args) => execFileSync('git', ['-C', sources, ...args], {maxBuffer: 1 << 26});
  try {
    mkdirSync(folder);
    for (const name of git('ls-tree', '--name-only', `${commit}:client_lib/view/web`).toString().trim().split('\n')) writeFileSync(`${folder}/${name}`, git('show', `${commit}:client_lib/view/web/${name}`));
    for (const name of ['messages.js', 'scenario.schema.json']) if (existsSync(`${built}/${name}`)) cpSync(`${built}/${name}`, `${folder}/${name}`);
    symlinkSync(`${built}/node_modules`, `${folder}/node_modules`);
    execFileSync(`${built}/node_modules/.bin/vite`, ['build', '--logLevel', 'error'], {cwd: folder, env: {...process.env, TAKT_PAGE_DIR: `${folder}/dist`}, stdio: 'pipe'});
  } catch (error) {
    console.log(`no page of ${commit} to compare with: ${String(error.stderr ?? '') || error.message}`);
    return null;
  }
  return (path) => { const file = `${folder}/dist${path === '/' ? '/index.html' : path}`; return existsSync(file) ? readFileSync(file) : null; };
}
const KINDS = {html: 'text/html', js: 'text/javascript', css: 'text/css', txt: 'text/plain', svg: 'image/svg+xml'};

const browser = await chromium.launch({...here, args: [...here.args, '--disable-gpu']});
// `files`: of another page than that of takt view. Two frames are drawn by itself, then only when it is asked.
async function open(url, files) {
  const page = await (await browser.newContext({viewport: {width: 1400, height: 900}, deviceScaleFactor: 1})).newPage();
  await page.addInitScript(() => { window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 200); });
  if (files) await page.route((at) => at.href.startsWith(url), (route) => {
    const {pathname} = new URL(route.request().url()), body = files(pathname);
    return body ? route.fulfill({body, contentType: KINDS[pathname === '/' ? 'html' : pathname.split('.').at(-1)] ?? 'application/octet-stream'}) : route.continue();
  });
  await page.goto(url);
  const shows = await page.waitForFunction(() => takt.last.state && takt.cell.components.length, null, {timeout: files ? 60000 : 300000, polling: 100}).catch(() => null);
  if (shows) return page;
  console.log(`${files ? against : 'the page'} shows no cell`);
  await page.context().close();
  return null;
}
// ms of one frame until its pixels can be read: of a standing picture, and of one whose state came again, with all that follows.
const stand = (page) => page.evaluate(([width, height]) => {
  const {cell} = takt;
  cell.draw = () => {};
  cell.renderer.setPixelRatio(1);
  cell.renderer.setSize(width, height, false);
  const camera = cell.eye?.deep ?? cell.camera;
  camera.aspect = width / height;
  camera.updateProjectionMatrix();
}, SIZE);
const lookFrom = (page, at) => page.evaluate(({camera, target}) => { takt.cell.camera.position.fromArray(camera); takt.cell.orbit.target.fromArray(target); takt.cell.orbit.update(); }, at);
const frame = (page, moving) => page.evaluate((again) => {
  const {cell} = takt, gl = cell.renderer.getContext(), pixel = new Uint8Array(4), begun = performance.now();
  if (again) { cell.show(takt.last.state); if (takt.last.contacts) cell.showContacts(takt.last.contacts); }
  cell.renderer.render(cell.scene, cell.camera);
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  return performance.now() - begun;
}, moving);
// With the shadows drawn again in it, as the page does once a second.
const shaded = (page) => page.evaluate(() => { takt.cell.renderer.shadowMap.needsUpdate = true; });
const median = (values) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];

const other = pageOf(against);
console.log(`frames of ${SIZE.join(' x ')} pixels, ms, median of ${frames}${other ? `; before: the page of ${against}` : ''}`);
const columns = [['cell', 18], ['triangles', 10], ...(other ? [['before', 8]] : []), ['page', 8], ...(other ? [['ratio', 6]] : []), ['moving', 8], ['with shadows', 12], ['mean of a second', 16]];
console.log(columns.map(([title, width]) => title.padStart(width)).join('  '));
for (const cell of cells) {
  const running = await start('takt-server', [`${sources}/config/scenarios/${cell}.yaml`, '--cell', process.env.TAKT_CELL, '--paused']), {child, url} = await view();
  const pages = [await open(url), ...(other ? [await open(url, other)] : [])].filter(Boolean);
  const at = await pages[0].evaluate(() => ({camera: takt.cell.camera.position.toArray(), target: takt.cell.orbit.target.toArray(), triangles: takt.last.description.components.reduce((sum, {triangles}) => sum + triangles.length / 3, 0)}));
  for (const page of pages) { await stand(page); await lookFrom(page, at); for (let n = 0; n < 3; ++n) await frame(page, true); }
  const times = {still: pages.map(() => []), moving: [], shaded: []};
  for (let n = 0; n < frames; ++n) {
    for (const [i, page] of pages.entries()) times.still[i].push(await frame(page, false));
    times.moving.push(await frame(pages[0], true));
    await shaded(pages[0]);
    times.shaded.push(await frame(pages[0], true));
  }
  // A second of a cell that moves has one frame with shadows.
  const [now, before = NaN] = times.still.map(median), moving = median(times.moving), shadows = median(times.shaded), mean = 1000 / Math.max(1 + (1000 - shadows) / moving, 1);
  const texts = [cell, String(at.triangles), ...(other ? [before.toFixed(1)] : []), now.toFixed(1), ...(other ? [(now / before).toFixed(2)] : []), moving.toFixed(1), shadows.toFixed(1), mean.toFixed(1)];
  console.log(texts.map((text, i) => text.padStart(columns[i][1])).join('  '));
  for (const page of pages) await page.context().close();
  await stop(child);
  await stop(running);
}
await browser.close();
process.exit(0);
