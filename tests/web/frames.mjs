// Time of a frame of the page in software rendering, beside that of another page: ./dev bench view frames [--against COMMIT | none]
// [--cells NAME,...] [--frames N]. The other one is the page of that commit (by default the last before the page had panels),
// built here with the packages of this one; both show the same cell through the same takt view, from the same place, on as many
// pixels, and their frames are measured by turns in one run, in processor time. Printed, not judged: it depends on the machine.
import {execFileSync} from 'node:child_process';
import {cpSync, existsSync, mkdirSync, readFileSync, readdirSync, symlinkSync, writeFileSync} from 'node:fs';
import {chromium, executable} from './browser.mjs';
import {sources, start, stop, takt, view} from './processes.mjs';

const BEFORE = '2f05aa74~1', SIZE = [900, 600];
const given = process.argv.slice(2), valueOf = (name, otherwise) => (given.includes(name) ? given[given.indexOf(name) + 1] : otherwise);
const against = valueOf('--against', BEFORE), frames = Number(valueOf('--frames', 8)), cells = valueOf('--cells', 'block_assembly,chainsaw_motor,bev_rotor').split(',');
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

// Processor time of the process that draws, s: on a busy machine it is what a frame costs, its duration is not.
const drawer = (of = process.pid) => readdirSync('/proc').filter((name) => /^\d+$/.test(name)).map((pid) => { try { return {pid: Number(pid), stat: readFileSync(`/proc/${pid}/stat`, 'utf8').split(') ')[1].split(' '), line: readFileSync(`/proc/${pid}/cmdline`, 'utf8')}; } catch { return null; } }).filter(Boolean)
  .reduce((found, one, i, all) => found ?? (one.line.includes('--type=gpu-process') && descends(one, of, all) ? one.pid : null), null);
const descends = (one, from, all) => { for (let at = one; at; at = all.find(({pid}) => pid === Number(at.stat[1]))) if (at.pid === from) return true; return false; };
const spent = (pid) => { const fields = readFileSync(`/proc/${pid}/stat`, 'utf8').split(') ')[1].split(' '); return (Number(fields[11]) + Number(fields[12])) / 100; };

const browser = await chromium.launch({...here, args: [...here.args, '--disable-gpu', '--disable-features=LocalNetworkAccessChecks']});
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
// The page finds by itself whether its frames are slow here; those that move are drafts then.
async function pace(page) {
  await page.waitForFunction(() => { takt.cell.dirty = true; return takt.cell.quality.times.full.length >= 5; }, null, {timeout: 120000, polling: 300});
  await page.waitForFunction(() => takt.cell.settled, null, {timeout: 300000, polling: 100});
  return page.evaluate(() => takt.cell.quality.slow);
}
// ms of processor time for each of BATCH frames, drawn until their pixels can be read: of a standing picture, in full; of one whose
// state came again, with all that follows, as the page draws what moves; and of one whose shadows are drawn again too, as the
// page does once a second while what casts them moves.
const BATCH = 6;
async function frame(page, kind) {
  const pid = drawer(), begun = spent(pid);
  await page.evaluate(([again, shadows, count]) => {
    const {cell} = takt, gl = cell.renderer.getContext(), pixel = new Uint8Array(4);
    for (let n = 0; n < count; ++n) {
      if (again) { cell.show(takt.last.state); if (takt.last.contacts) cell.showContacts(takt.last.contacts); }
      if (shadows) { cell.cast = null; cell.shade(0); }
      if (cell.quality) cell.quality.draw(cell.scene, cell.camera, !again || !cell.quality.slow);
      else cell.renderer.render(cell.scene, cell.camera);
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    }
  }, [kind !== 'still', kind === 'shaded', BATCH]);
  return 1000 * (spent(pid) - begun) / BATCH;
}
const median = (values) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];

const other = pageOf(against);
console.log(`frames of ${SIZE.join(' x ')} pixels, ms of processor time, median of ${frames} times ${BATCH}${other ? `; before: the page of ${against}` : ''}`);
const columns = [['cell', 18], ['triangles', 10], ...(other ? [['before', 8], ['moving', 8]] : []), ['standing', 8], ['moving', 8], ['drafts', 6], ['with shadows', 12], ['mean of a second', 16], ...(other ? [['of standing', 11], ['of moving', 9]] : [])];
console.log(columns.map(([title, width]) => title.padStart(width)).join('  '));
for (const cell of cells) {
  const running = await start('takt-server', [`${sources}/config/scenarios/${cell}.yaml`, '--cell', process.env.TAKT_CELL, '--paused']), {child, url} = await view();
  const pages = [await open(url), ...(other ? [await open(url, other)] : [])].filter(Boolean);
  const slow = await pace(pages[0]);
  const at = await pages[0].evaluate(() => ({camera: takt.cell.camera.position.toArray(), target: takt.cell.orbit.target.toArray(), triangles: takt.last.description.components.reduce((sum, {triangles}) => sum + triangles.length / 3, 0)}));
  for (const page of pages) { await stand(page); await lookFrom(page, at); await frame(page, 'moving'); }
  const WAYS = ['still', 'moving', 'shaded'], times = pages.map(() => Object.fromEntries(WAYS.map((kind) => [kind, []])));
  for (let n = 0; n < frames; ++n)
    for (const kind of WAYS)
      for (const [i, page] of pages.entries()) if (i === 0 || kind !== 'shaded') times[i][kind].push(await frame(page, kind));
  // A second of a cell that moves has one frame with shadows.
  const [now, before] = times.map(({still, moving, shaded}) => ({still: median(still), moving: median(moving), shaded: median(shaded)}));
  const mean = 1000 / Math.max(1 + (1000 - now.shaded) / now.moving, 1);
  const numbers = [...(before ? [before.still, before.moving] : []), now.still, now.moving].map((value) => value.toFixed(1));
  const texts = [cell, String(at.triangles), ...numbers, slow ? 'yes' : 'no', now.shaded.toFixed(1), mean.toFixed(1), ...(before ? [now.still / before.still, mean / before.moving].map((value) => value.toFixed(2)) : [])];
  console.log(texts.map((text, i) => text.padStart(columns[i][1])).join('  '));
  for (const page of pages) await page.context().close();
  await stop(child);
  await stop(running);
}
await browser.close();
process.exit(0);
