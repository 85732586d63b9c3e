// A recording is sent again with its timing, and recorded again: the same samples.
import {strict as assert} from 'node:assert';
import {execFileSync} from 'node:child_process';
import {scenario, start} from './processes.mjs';

process.env.TAKT_CELL = 'cell';
const exported = (file) => execFileSync(`${process.env.TAKT_BIN}/takt`, ['--json', 'export', file], {encoding: 'utf8', maxBuffer: 1 << 30})
  .trim().split('\n').map((line) => JSON.parse(line));

await (await start('takt-run', [scenario, '--duration', '4', '--mcap', 'run.mcap', '--quiet'])).ended;
const recorder = await start('takt', ['record', 'again.mcap', '--until', '3.9']);
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
assert.equal(heard.at(-1).time, 3.9);
console.log(`${after.length} of ${before.length} samples sent and recorded again`);
process.exit(0);
