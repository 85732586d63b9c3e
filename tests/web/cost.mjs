// What looking costs: processor time of takt view with one who looks, and the overruns of the server's steps with none,
// one, ten. ./dev bench view [SECONDS] [--browser]. Those who look are WebSockets that ask for what the page asks for; with
// --browser pages of one Chromium, which draws with the processor here. Printed, not judged: it depends on what else the
// machine does.
import {readFileSync} from 'node:fs';
import WebSocket from 'ws';
import {server, start, stop, program, takt, view} from './processes.mjs';

const browsers = process.argv.includes('--browser');
const seconds = Number(process.argv.slice(2).find((argument) => argument !== '--browser') ?? 15);
const running = await server('--paused');
const {child, url} = await view();
await start('takt-controller', [program, '--start', '--pace', 'realtime', '--until', '100000']);

while (takt('status').step < 1000) await new Promise((done) => setTimeout(done, 500));

const spent = (pid) => {
  const fields = readFileSync(`/proc/${pid}/stat`, 'utf8').split(') ')[1].split(' ');
  return (Number(fields[11]) + Number(fields[12])) / 100;
};
const wait = (s) => new Promise((done) => setTimeout(done, 1000 * s));
const lookers = [];
let chromium = null;
if (browsers) {
  const found = await import('./browser.mjs');
  chromium = await found.chromium.launch(found.executable());
}
// A page in a context of its own; frames are those that it has drawn.
async function open() {
  const page = await (await chromium.newContext({viewport: {width: 400, height: 300}})).newPage();
  await page.goto(url);
  await page.waitForFunction(() => takt.last.state && takt.cell.frames > 0, null, {timeout: 120000});
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

console.log(`lookers  takt view, % of a core  ${browsers ? 'frames/s each' : 'states/s each'}  kB/s each  server, % of a core  steps overrun of 1000  load of the machine`);
for (const count of [0, 1, 10, 0]) {  // none again: what else the machine does has changed meanwhile
  while (lookers.length > count) await lookers.pop().socket.close();
  while (lookers.length < count) browsers ? await open() : look();
  await wait(3);
  const before = takt('status'), began = [spent(child.pid), spent(running.pid)], t = process.hrtime.bigint();
  for (const looker of lookers) looker.frames = looker.bytes = 0;
  if (browsers) for (const looker of lookers) looker.frames = -(await looker.count());
  await wait(seconds);
  if (browsers) for (const looker of lookers) looker.frames += await looker.count();
  const passed = Number(process.hrtime.bigint() - t) / 1e9, after = takt('status');
  const mean = (member) => (lookers.length ? lookers.reduce((sum, looker) => sum + looker[member], 0) / lookers.length / passed : 0);
  const load = readFileSync('/proc/loadavg', 'utf8').split(' ')[0];
  console.log(`${String(count).padStart(7)}  ${(100 * (spent(child.pid) - began[0]) / passed).toFixed(1).padStart(23)}  ${mean('frames').toFixed(1).padStart(13)}  ${(mean('bytes') / 1000).toFixed(0).padStart(9)}  ${(100 * (spent(running.pid) - began[1]) / passed).toFixed(1).padStart(19)}  ${(1000 * (after.overruns - before.overruns) / Math.max(after.step - before.step, 1)).toFixed(1).padStart(22)}  ${load.padStart(19)}`);
}
await chromium?.close();
await stop(child);
await stop(running);
process.exit(0);
