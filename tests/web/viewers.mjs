// Cost of viewers: processor time and bytes of takt view, and the overruns of the server's steps, without a viewer, with one, with
// ten, and with ten beside two that are frozen. All of a cell are measured in one run, with rows without a viewer in between, since
// the machine's other load changes; a row is compared with its two neighbours of that kind. ./dev bench view [SECONDS]
// [--cells NAME,...] [--pages | --sockets] [--frames N] [--realtime-priority N]. Sockets ask for what the page asks for, at its
// rate; pages are real ones, of one Chromium that draws with the processor here and so takes what the server needs, and draw
// FRAMES times per second (0: as often as they can) for that reason. A frozen page stands in its debugger, a frozen socket reads
// no byte. --realtime-priority N is handed to takt-server: with it the pages get what its steps leave. The bounds are printed with
// what was found, not judged: it depends on the machine.
import {readFileSync} from 'node:fs';
import WebSocket from 'ws';
import {sources, start, stop, program, takt, view} from './processes.mjs';

const given = process.argv.slice(2), valueOf = (name, otherwise) => (given.includes(name) ? given[given.indexOf(name) + 1] : otherwise);
const NAMED = ['--frames', '--realtime-priority', '--cells'];
const seconds = Number(given.find((argument, i) => /^[0-9.]+$/.test(argument) && !NAMED.includes(given[i - 1])) ?? 15);
const framesPerSecond = Number(valueOf('--frames', 2)), priority = Number(valueOf('--realtime-priority', 0));
const cells = valueOf('--cells', 'block_assembly,chainsaw_motor').split(',');
// Bounds: of a core and of bytes for each viewer; overruns with ten viewers and two frozen ones against those without.
const MOST_PERCENT = 5, MOST_KB = 1000, MOST_RATIO = 1.5, NOISE = 2;  // the last: overruns of 1000 that two rows without a viewer are apart

const spent = (pid) => {
  const fields = readFileSync(`/proc/${pid}/stat`, 'utf8').split(') ')[1].split(' ');
  return (Number(fields[11]) + Number(fields[12])) / 100;
};
const megabytes = (pid) => Number(readFileSync(`/proc/${pid}/status`, 'utf8').match(/VmRSS:\s+(\d+)/)[1]) / 1000;
const wait = (s) => new Promise((done) => setTimeout(done, 1000 * s));
let chromium = null;
if (!given.includes('--sockets')) {
  const found = await import('./browser.mjs');
  const {executablePath, args} = found.executable(true) ?? {};
  if (executablePath) chromium = await found.chromium.launch({executablePath, args: [...args, '--disable-gpu']});
  else console.log('no pages: Chromium is not installed, or the page was not built');
}
let url, lookers = [];
// A page in a context of its own; frames are those that it has drawn.
async function open(frozen = false) {
  const page = await (await chromium.newContext({viewport: {width: 320, height: 240}})).newPage();
  if (framesPerSecond > 0)
    await page.addInitScript((rate) => { window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 1000 / rate); }, framesPerSecond);
  try {
    await page.goto(url, {timeout: 300000});
    await page.waitForFunction(() => takt.last.state && takt.cell.frames > 0, null, {timeout: 300000});
  } catch (error) {
    console.log(`this machine does not get a page more open within five minutes: ${error.message.split('\n')[0]}`);
    await page.context().close();
    return false;
  }
  const debug = frozen ? await page.context().newCDPSession(page) : null;
  await debug?.send('Debugger.enable');
  await debug?.send('Debugger.pause');
  lookers.push({frozen, read: () => page.evaluate(() => [takt.cell.frames, takt.link.received]), close: async () => {
    await debug?.send('Debugger.resume').catch(() => {});
    await page.context().close();
  }});
}
function look(frozen = false) {
  const socket = new WebSocket(url.replace('http', 'ws'), ['foxglove.websocket.v1']), counts = [0, 0];
  let state = null;
  socket.on('message', (data, binary) => {
    if (binary) {
      counts[1] += data.length;
      if (data.readUInt32LE(1) === state) ++counts[0];
      return;
    }
    const message = JSON.parse(data);
    if (message.op !== 'advertise') return;
    const wanted = message.channels.filter(({topic}) => /\/(state|description|status|events|contacts)$/.test(topic));
    state ??= wanted.find(({topic}) => topic.endsWith('/state'))?.id;
    if (wanted.length) socket.send(JSON.stringify({op: 'subscribe', subscriptions: wanted.map(({id}) => ({id, channelId: id}))}));
    if (frozen && state !== undefined) socket.pause();
  });
  lookers.push({frozen, read: () => [...counts], close: () => socket.terminate()});
}

const busy = () => {  // processor time of the whole machine, s
  const fields = readFileSync('/proc/stat', 'utf8').split('\n')[0].split(/\s+/).slice(1, 9).map(Number);
  return (fields.reduce((sum, value) => sum + value, 0) - fields[3] - fields[4]) / 100;
};
const columns = [['viewers', 24], ['takt view, % of a core', 22], ['each', 6], ['its MB', 6], ['server, % of a core', 19], ['machine, % of a core', 20], ['steps overrun of 1000', 21], ['wake-up p99, ms', 15], ['samples or frames/s each', 24], ['kB/s each', 9]];
const rows = [[0]];
if (!given.includes('--pages')) rows.push([1, 0, look, 'socket'], [10, 0, look, 'socket'], [10, 2, look, 'socket'], [0]);
if (chromium) rows.push([1, 0, open, 'page'], [10, 0, open, 'page'], [10, 2, open, 'page'], [0]);

const name = (count, frozen, kind) => (count ? `${count} ${kind}${count > 1 ? 's' : ''}${frozen ? `, ${frozen} frozen` : ''}` : 'none');
async function measure(cell) {
  const running = await start('takt-server', [`${sources}/config/scenarios/${cell}.yaml`, '--cell', process.env.TAKT_CELL, '--paused', ...(priority > 0 ? ['--realtime-priority', String(priority)] : [])]);
  const {child, url: at} = await view();
  url = at;
  const controller = cell === 'block_assembly' ? await start('takt-controller', [program, '--start', '--pace', 'realtime', '--until', '100000']) : null;
  if (!controller) { await wait(2); takt('play'); }
  while (takt('status').step < 1000) await wait(0.5);
  // The requested priority, and the scheduling that the machine granted.
  console.log(`\n${cell}; real-time priority ${priority || 'none'}: ${takt('status').scheduling || 'the usual scheduling'}`);
  console.log(columns.map(([title, width]) => title.padStart(width)).join('  '));
  const found = [];
  for (const [wanted, frozen = 0, add, kind] of rows) {
    if (wanted < 2) while (lookers.length) await lookers.pop().close();
    while (lookers.filter((one) => !one.frozen).length < wanted && (await add()) !== false);
    // One of each kind is frozen.
    for (let n = 0; n < frozen; ++n) { if (n === 0 && kind === 'page') await open(true); else look(true); }
    const looking = lookers.filter((one) => !one.frozen), count = looking.length;
    await wait(3);
    const read = async () => (await Promise.all(looking.map((one) => one.read()))).reduce(([a, b], [x, y]) => [a + x, b + y], [0, 0]);
    const before = takt('status'), began = [spent(child.pid), spent(running.pid), busy()], counts = await read(), t = process.hrtime.bigint();
    await wait(seconds);
    const passed = Number(process.hrtime.bigint() - t) / 1e9, after = takt('status'), percent = [spent(child.pid), spent(running.pid), busy()].map((now, i) => 100 * (now - began[i]) / passed);
    const each = (await read()).map((now, i) => (count ? (now - counts[i]) / count / passed : 0));
    const row = {kind: name(count, frozen, kind), wanted, frozen, page: kind === 'page', percent, overruns: 1000 * (after.overruns - before.overruns) / Math.max(after.step - before.step, 1), kilobytes: each[1] / 1000};
    found.push(row);
    const idle = found.findLast((one) => one.wanted === 0).percent[0];
    row.each = count ? Math.max(percent[0] - idle, 0) / (count + frozen) : 0;
    const texts = [row.kind, percent[0].toFixed(1), count ? row.each.toFixed(2) : '', megabytes(child.pid).toFixed(0), percent[1].toFixed(1), percent[2].toFixed(1), row.overruns.toFixed(2),
      (1000 * after.wakeup_latency_p99).toFixed(3), count ? each[0].toFixed(1) : '', count ? row.kilobytes.toFixed(0) : ''];
    console.log(texts.map((text, i) => text.padStart(columns[i][1])).join('  '));
  }
  while (lookers.length) await lookers.pop().close();
  // Rows beside those without a viewer before and after them.
  for (const [i, row] of found.entries()) {
    if (row.wanted < 10) continue;
    const [a, b] = [found.slice(0, i).findLast(({wanted}) => wanted === 0), found.slice(i).find(({wanted}) => wanted === 0)].map(({overruns}) => overruns), without = (a + b) / 2;
    const ratio = row.overruns / Math.max(without, 1e-9), alone = row.overruns <= MOST_RATIO * without || row.overruns - Math.max(a, b) <= NOISE;
    console.log(`${row.kind}: ${row.overruns.toFixed(2)} of 1000 steps overrun, ${a.toFixed(2)} and ${b.toFixed(2)} without: ${without > 0 ? `ratio ${ratio.toFixed(2)} (bound ${MOST_RATIO}, or ${NOISE} of 1000): ` : ''}${alone ? 'held' : 'missed'}`);
  }
  for (const [what, most, of] of [['% of a core for each viewer', MOST_PERCENT, ({each}) => each], ['kB/s for each viewer', MOST_KB, ({kilobytes}) => kilobytes]]) {
    const worst = Math.max(...found.filter(({wanted}) => wanted > 0).map(of));
    console.log(`${what}: ${worst.toFixed(2)} at most (bound ${most}): ${worst <= most ? 'held' : 'missed'}`);
  }
  if (controller) await stop(controller);
  await stop(child);
  await stop(running);
}
for (const cell of cells) await measure(cell);
await chromium?.close();
process.exit(0);
