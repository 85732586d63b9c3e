// Cost of viewers: processor time of takt view, and the overruns of the server's steps, with no viewer, one and ten. All are
// measured in one run, with rows without a viewer in between, since the machine's other load changes. ./dev bench view [SECONDS]
// [--pages | --sockets] [--realtime-priority N]. Sockets ask for what the page asks for, at its rate; pages are real ones, of one Chromium that draws
// with the processor here and so takes what the server needs, and draw FRAMES times per second (--frames N; 0: as often as
// they can) for that reason. --realtime-priority N is handed to takt-server: with it the pages get what its steps leave.
// Printed, not judged: it depends on the machine.
import {readFileSync} from 'node:fs';
import WebSocket from 'ws';
import {server, start, stop, program, takt, view} from './processes.mjs';

const given = process.argv.slice(2), valueOf = (name, otherwise) => (given.includes(name) ? Number(given[given.indexOf(name) + 1]) : otherwise);
const seconds = Number(given.find((argument, i) => /^[0-9.]+$/.test(argument) && !['--frames', '--realtime-priority'].includes(given[i - 1])) ?? 15);
const framesPerSecond = valueOf('--frames', 2);
const priority = valueOf('--realtime-priority', 0);
const running = await server('--paused', ...(priority > 0 ? ['--realtime-priority', String(priority)] : []));
const {child, url} = await view();
await start('takt-controller', [program, '--start', '--pace', 'realtime', '--until', '100000']);

while (takt('status').step < 1000) await new Promise((done) => setTimeout(done, 500));
// The requested priority, and the scheduling that the machine granted.
console.log(`real-time priority ${priority || 'none'}: ${takt('status').scheduling || 'the usual scheduling'}`);

const spent = (pid) => {
  const fields = readFileSync(`/proc/${pid}/stat`, 'utf8').split(') ')[1].split(' ');
  return (Number(fields[11]) + Number(fields[12])) / 100;
};
const wait = (s) => new Promise((done) => setTimeout(done, 1000 * s));
const lookers = [];
let chromium = null;
if (!given.includes('--sockets')) {
  const found = await import('./browser.mjs');
  const {executablePath, args} = found.executable(true) ?? {};
  if (executablePath) chromium = await found.chromium.launch({executablePath, args: [...args, '--disable-gpu']});
  else console.log('no pages: Chromium is not installed, or the page was not built');
}
// A page in a context of its own; frames are those that it has drawn.
async function open() {
  const page = await (await chromium.newContext({viewport: {width: 320, height: 240}})).newPage();
  if (framesPerSecond > 0)
    await page.addInitScript((rate) => { window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 1000 / rate); }, framesPerSecond);
  try {
    await page.goto(url, {timeout: 300000});
    await page.waitForFunction(() => takt.last.state && takt.cell.frames > 0, null, {timeout: 300000});
  } catch (error) {
    console.log(`this machine does not get a page more open within a minute: ${error.message.split('\n')[0]}`);
    await page.context().close();
    return false;
  }
  const looker = {frames: 0, bytes: 0, count: () => page.evaluate(() => takt.cell.frames), socket: {close: () => page.context().close()}};
  lookers.push(looker);
}
function look() {
  const socket = new WebSocket(url.replace('http', 'ws'), ['foxglove.websocket.v1']);
  const looker = {frames: 0, bytes: 0, state: null, socket};
  socket.on('message', (data, binary) => {
    if (binary) {
      looker.bytes += data.length;
      if (data.readUInt32LE(1) === looker.state) ++looker.frames;
      return;
    }
    const message = JSON.parse(data);
    if (message.op !== 'advertise') return;
    const wanted = message.channels.filter(({topic}) => /\/(state|description|status|events|contacts)$/.test(topic));
    looker.state ??= wanted.find(({topic}) => topic.endsWith('/state'))?.id;
    if (wanted.length) socket.send(JSON.stringify({op: 'subscribe', subscriptions: wanted.map(({id}) => ({id, channelId: id}))}));
  });
  lookers.push(looker);
}

const busy = () => {  // processor time of the whole machine, s
  const fields = readFileSync('/proc/stat', 'utf8').split('\n')[0].split(/\s+/).slice(1, 9).map(Number);
  return (fields.reduce((sum, value) => sum + value, 0) - fields[3] - fields[4]) / 100;
};
const columns = [['viewers', 12], ['takt view, % of a core', 22], ['server, % of a core', 19], ['machine, % of a core', 20], ['steps overrun of 1000', 21], ['wake-up p99, ms', 15], ['samples or frames/s each', 24], ['kB/s each', 9]];
console.log(columns.map(([name, width]) => name.padStart(width)).join('  '));
const rows = [];
if (!given.includes('--pages')) rows.push([0], [1, look, 'socket'], [10, look, 'socket']);
if (chromium) rows.push([0], [1, open, 'page'], [10, open, 'page']);
for (const [wanted, add, kind] of [...rows, [0]]) {
  if (wanted < 2) while (lookers.length) await lookers.pop().socket.close();
  while (lookers.length < wanted && (await add()) !== false);
  const count = lookers.length;
  await wait(3);
  const pages = kind === 'page';
  const before = takt('status'), began = [spent(child.pid), spent(running.pid), busy()], t = process.hrtime.bigint();
  for (const looker of lookers) looker.frames = looker.bytes = 0;
  if (pages) for (const looker of lookers) looker.frames = -(await looker.count());
  await wait(seconds);
  if (pages) for (const looker of lookers) looker.frames += await looker.count();
  const passed = Number(process.hrtime.bigint() - t) / 1e9, after = takt('status');
  const mean = (member) => (lookers.length ? lookers.reduce((sum, looker) => sum + looker[member], 0) / lookers.length / passed : 0);
  const percent = (now, i) => (100 * (now - began[i]) / passed).toFixed(1);
  const row = [count ? `${count} ${kind}${count > 1 ? 's' : ''}` : 'none', percent(spent(child.pid), 0), percent(spent(running.pid), 1), percent(busy(), 2),
    (1000 * (after.overruns - before.overruns) / Math.max(after.step - before.step, 1)).toFixed(2), (1000 * after.wakeup_latency_p99).toFixed(3),
    count ? mean('frames').toFixed(1) : '', count && !pages ? (mean('bytes') / 1000).toFixed(0) : ''];
  console.log(row.map((value, i) => value.padStart(columns[i][1])).join('  '));
}
await chromium?.close();
await stop(child);
await stop(running);
process.exit(0);
