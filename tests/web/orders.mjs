// Server and tools are started in several orders (--all: in every one), each of them is stopped and started again while
// the others go on, and all of them work each time: no program needs the restart of another. The test polls the programs
// that follow the cell for their newest output; it never waits a fixed time.
import {strict as assert} from 'node:assert';
import {readFileSync, statSync, writeFileSync} from 'node:fs';
import WebSocket from 'ws';
import {server, start, stop, takt, view} from './processes.mjs';

const NAMES = ['server', 'view', 'controller', 'watch', 'record'];
// A program that has no end.
const program = 'to_and_fro.lua';
writeFileSync(program, `
routine("Robot1", function(r)
  while true do
    r:move_joints({0.2, -1.2, -2.1, -1.4, 1.57, 0})
    r:move_joints({-0.2, -1.2, -2.1, -1.4, 1.57, 0})
  end
end)
`);
let page = 0;         // port of takt view: that of its first start
let recordings = 0;
const waiting = ['--timeout', '600'];
const begin = {
  server: () => server(),
  view: async () => {
    const {child, url} = await view(page);
    page = Number(new URL(url).port);
    return child;
  },
  controller: () => start('takt-controller', [program, '--start', ...waiting]),
  watch: () => start('takt', ['watch', '--json', ...waiting]),
  record: async () => Object.assign(await start('takt', ['record', `run${++recordings}.mcap`, ...waiting]), {file: `run${recordings}.mcap`}),
};

// Resolves when the page's stream has had states of a moving cell since it was asked.
function looks(port) {
  return new Promise((resolve) => {
    let socket, times = new Set(), over = false;
    const connect = () => {
      let channel = null;
      socket = new WebSocket(`ws://127.0.0.1:${port}/`, ['foxglove.websocket.v1']);
      socket.on('error', () => {});
      socket.on('close', () => { if (!over) setTimeout(connect, 100); });
      socket.on('message', (data, binary) => {
        if (binary) {
          if (data.readUInt32LE(1) === channel) times.add(data.readBigUInt64LE(5));
          if (times.size > 5) { over = true; socket.close(); resolve(); }
          return;
        }
        const message = JSON.parse(data);
        const found = message.op === 'advertise' && message.channels.find(({topic}) => topic.endsWith('/state'));
        if (found) { channel = found.id; socket.send(JSON.stringify({op: 'subscribe', subscriptions: [{id: 1, channelId: found.id}]})); channel = 1; }
      });
    };
    connect();
  });
}
const later = () => new Promise((done) => setTimeout(done, 50));
async function until(what, condition) {
  const begun = Date.now();
  for (let said = 0; !(await condition());) {
    if (Date.now() - begun > 20000 * ++said) console.log(`still waiting: ${what}`);
    await later();
  }
}
const status = () => { try { return takt('status'); } catch { return null; } };

// All of them work, with what they have seen from now on.
async function allWork(running) {
  for (const name of NAMES) assert.ok(running[name].exitCode === null, `${name} has ended: ${running[name].text}`);
  // The cell takes commands: those of the controller, the only sender.
  let applied = null;
  await until('the controller', () => {
    const s = status();
    if (s?.state !== 'playing') return false;
    if (applied === null || s.commands_applied < applied) applied = s.commands_applied;
    return s.commands_applied > applied + 10;
  });
  await looks(page);
  const size = statSync(running.record.file, {throwIfNoEntry: false})?.size ?? 0;
  await until('the recording', () => (statSync(running.record.file, {throwIfNoEntry: false})?.size ?? 0) > size);
  // The watcher follows this server: it prints the pace when the pace changes.
  const factor = 1 + Math.round(1000 * Math.random()) / 1000, seen = running.watch.text.length;
  takt('pace', 'realtime', '--factor', String(factor));
  takt('pause');
  await until('the watcher', () => running.watch.text.slice(seen).includes('"paused"'));
  takt('play');
  await until('the watcher', () => running.watch.text.slice(seen).split('"paused"').pop().includes('"playing"'));
}

function permutations(list) {
  return list.length < 2 ? [list] : list.flatMap((first, i) => permutations(list.toSpliced(i, 1)).map((rest) => [first, ...rest]));
}
// Otherwise two, in which each comes before and after each other one.
const orders = process.argv.includes('--all') ? permutations(NAMES) : [NAMES, [...NAMES].reverse()];

for (const order of orders) {
  const running = {};
  for (const name of order) running[name] = await begin[name]();
  await allWork(running);
  console.log(`started: ${order.join(', ')}`);
  for (const name of order) {
    const old = running[name];
    await stop(old);
    if (name === 'record') assert.match(readFileSync(old.file).subarray(-8).toString('latin1'), /^\x89MCAP0\r\n$/);
    running[name] = await begin[name]();
    await allWork(running);
    console.log(`  restarted: ${name}`);
  }
  for (const name of [...order].reverse()) await stop(running[name]);
}
console.log('all work after every start and restart');
process.exit(0);
