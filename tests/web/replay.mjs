// A recording is sent again with its timing, and recorded again: the same samples.
import {strict as assert} from 'node:assert';
import {execFileSync} from 'node:child_process';
import {existsSync, readFileSync, statSync} from 'node:fs';
import {patient, scenario, start} from './processes.mjs';

process.env.TAKT_CELL = 'cell';
const exported = (file) => execFileSync(`${process.env.TAKT_BIN}/takt`, ['--json', 'export', file], {encoding: 'utf8', maxBuffer: 1 << 30})
  .trim().split('\n').map((line) => JSON.parse(line));

await (await start('takt-run', ['run', scenario, '--duration', '4', '--mcap', 'run.mcap', '--quiet'])).ended;
const recorder = await start('takt', ['record', 'again.mcap', '--until', '3.9', ...patient]);
const begin = process.hrtime.bigint();
const player = await start('takt', ['replay', 'run.mcap', '--rate', '0.5']);
assert.equal(await recorder.ended, 0, recorder.text);
const took = Number(process.hrtime.bigint() - begin) / 1e9;
assert.equal(await player.ended, 0, player.text);
assert.ok(took >= 3.9 / 0.5 - 0.1, `at half the rate 3.9 s came within ${took} s`);

const before = exported('run.mcap'), after = exported('again.mcap');
const of = (list, topic) => list.filter((line) => line.topic === topic).map((line) => line.sample);
assert.deepEqual(of(after, '/cell/description'), of(before, '/cell/description'));
// Sent reliably: from the first that was heard on, each one, in order. The server of a cell numbers none of them.
for (const topic of ['/cell/Robot1/joint_states', '/cell/Robot2/joint_states']) {
  const sent = of(before, topic), heard = of(after, topic);
  assert.ok(heard.length > 100, `${heard.length} of ${topic}`);
  const first = sent.findIndex((sample) => JSON.stringify(sample) === JSON.stringify(heard[0]));
  assert.ok(first >= 0);
  assert.deepEqual(heard, sent.slice(first, first + heard.length));
}
// States are sent best effort; what comes is what was.
const states = new Map(of(before, '/cell/state').map((sample) => [sample.step, sample]));
const heard = of(after, '/cell/state');
assert.ok(heard.length > 100);
for (const sample of heard) assert.deepEqual(sample, states.get(sample.step));
assert.ok(heard.at(-2).time < 3.9 && heard.at(-1).time >= 3.9, `${heard.at(-2).time} and ${heard.at(-1).time} s`);
// A picture and a table of it, and what is said of them.
const say = (...args) => JSON.parse(execFileSync(`${process.env.TAKT_BIN}/takt`, ['--json', ...args], {encoding: 'utf8'}));
const table = say('export', 'run.mcap', '--csv', 'run.csv', '--signals', 'state.components.P.position.*');
assert.deepEqual(table.signals, ['x', 'y', 'z'].map((axis) => `state.components.P.position.${axis}`));
const rows = readFileSync('run.csv', 'utf8').trim().split('\n');
assert.equal(rows.length, table.rows + 1);
assert.equal(table.rows, of(before, '/cell/state').length);
assert.deepEqual(rows.at(-1).split(',').slice(2).map(Number).map((value) => value.toFixed(9)),
  Object.values(of(before, '/cell/state').at(-1).components.P.position).map((value) => value.toFixed(9)));
if (existsSync('/usr/bin/gnuplot')) {
  assert.deepEqual(say('plot', 'run.mcap', 'state.components.P.position.z', '-o', 'p.png').signals, ['state.components.P.position.z']);
  assert.equal(readFileSync('p.png').subarray(1, 4).toString(), 'PNG');
  say('plot', 'run.mcap', 'state.robots.*.position.*', '-o', 'p.svg');
  assert.match(readFileSync('p.svg', 'utf8'), /elbow_joint/);
}
// A recorder that is killed leaves what it has written so far, a second old at most.
const doomed = await start('takt', ['record', 'killed.mcap', ...patient]);
const again = await start('takt', ['replay', 'run.mcap']);
const written = () => (existsSync('killed.mcap') ? statSync('killed.mcap').size : 0);
const until = async (condition) => { while (!condition()) await new Promise((resolve) => setTimeout(resolve, 20)); };
await until(() => written() >= 50000);
const first = written();
await until(() => written() > first + 50000);  // a chunk is on its way to the file at any moment: the first one is whole then
doomed.kill('SIGKILL');
await doomed.ended.catch(() => {});
assert.equal(await again.ended, 0, again.text);
const left = say('export', 'killed.mcap', '--list');
assert.equal(left.complete, false);
assert.ok(left.chunks > 0 && left.signals.includes('state.components.P.position.x'));
console.log(`${after.length} of ${before.length} samples sent and recorded again`);
process.exit(0);
