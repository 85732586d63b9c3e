// Plots of takt view in Debian's Chromium: power, contact force, joint torque and temperature fill with the numbers that
// other clients get over DDS, and go on after a reset.
import {strict as assert} from 'node:assert';
import {execFileSync} from 'node:child_process';
import {existsSync, statSync, writeFileSync} from 'node:fs';
import {ALL_PIXELS, chromium, executable, visit} from './browser.mjs';
import {patient, server, sources, start, stop, takt, view} from './processes.mjs';

const browser = await chromium.launch(executable());
const begun = Date.now();
const stage = (what) => console.log(`${((Date.now() - begun) / 1000).toFixed(1)} s: ${what}`);

const small = {width: 900, height: 560};
const UNITS = {};  // of each curve, as the IDL or the device has it
const add = async (page, name) => {
  await page.fill('#signal', name);
  await page.click('#add-plot');
};
const filled = (until, names, count) =>
  until(([wanted, n]) => wanted.every((name) => takt.plots.has(name) && takt.plots.numbers(name).x.length >= n), [names, count]);
// Of a curve in a plot of its own: its numbers, those that the chart has, the newest one in words, and how much of its colour is
// on the canvas.
const read = (ask, name) => ask((wanted) => {
  const plot = takt.plots.plots.find(({curves}) => curves[0].name === wanted), canvas = plot.holder.querySelector('canvas');
  const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  const colour = plot.chart.series[1].stroke();
  const [r, g, b] = [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16));
  let drawn = 0;
  for (let i = 0; i < data.length; i += 4)
    if (data[i + 3] > 128 && Math.abs(data[i] - r) + Math.abs(data[i + 1] - g) + Math.abs(data[i + 2] - b) < 60) ++drawn;
  const {x, y} = takt.plots.numbers(wanted);
  return {x: [...x], y: [...y], chart: plot.chart.data.map((values) => [...values]), newest: plot.curves[0].newest.textContent, drawn};
}, name);
// A line as long as the plot is wide, at least.
function assertDrawn(name, plot) {
  assert.deepEqual(plot.chart, [plot.x, plot.y], `${name}: the chart has other numbers`);
  const [, number, unit] = plot.newest.match(/^(\S+)(?: (.+))?$/), newest = plot.y.at(-1);
  assert.ok(Math.abs(Number(number) - newest) <= 1e-4 * Math.abs(newest), `${name}: ${plot.newest} is not ${newest}`);
  assert.equal(unit, UNITS[name], name);
  assert.ok(plot.drawn > 100, `${name}: ${plot.drawn} pixels of its line`);
}
const drawn = async (ask) => {
  while (await ask(() => takt.plots.dirty));
  await ask(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
};
const offered = (until, names) => until((wanted) => wanted.every((name) => takt.lower.tree.has(name)), names);
// A recorder that hears the cell: what it has written is read back.
async function recording(file, until) {
  const recorder = await start('takt', ['record', file, '--until', until, ...patient]);
  while (!existsSync(file) || statSync(file).size < 20000) await new Promise((resolve) => setTimeout(resolve, 20));
  return recorder;
}
function exported(file) {
  const lines = execFileSync(`${process.env.TAKT_BIN}/takt`, ['--json', 'export', file], {encoding: 'utf8', maxBuffer: 1 << 30}).trim().split('\n').map((line) => JSON.parse(line));
  return (topic, value) => lines.filter((line) => line.topic === `/web_test/${topic}`).map(({sample}) => [sample.time, value(sample)]);
}
// The samples of another client at the same times. Samples are sent best effort, so not all times are common.
function compare(name, plot, samples) {
  const reported = new Map(samples), common = plot.x.filter((time) => reported.has(time));
  for (const time of common) assert.equal(plot.y[plot.x.indexOf(time)], reported.get(time), `${name} at ${time} s`);
  assert.ok(common.length > 20, `${name}: ${common.length} common times of ${samples.length}`);
}
// The arm moves and leaves the parts alone: P stands on the table whenever the cell is paused.
const program = 'move.lua';
writeFileSync(program, `
routine("Robot1", function(r)
  local low, high = pose{x = -0.30, y = 0.10, z = 1.00, roll = math.pi}, pose{x = -0.10, y = 0.00, z = 1.10, roll = math.pi}
  while true do
    r:move_to(low)
    r:move_to(high)
  end
end)
`);
stage('power, contact force, torque');
const running = await server('--paused', '--lod', '3', '--set', 'solver.method=implicit');
const {child: bridge, url} = await view();
const {page, problems, until, ask} = await visit(browser, url, small, {deviceScaleFactor: ALL_PIXELS});
const contact = 'contacts.contacts.P-Table1.normal_force', lifting = 'contacts.contacts.P-Table1.force.z';
const electrical = 'power.consumers.Robot1.electrical_power', torque = 'state.robots.Robot1.effort.shoulder_lift_joint';
const jointState = 'Robot1/joint_states.effort.shoulder_lift_joint';
const names = [electrical, contact, lifting, torque, jointState];
Object.assign(UNITS, {[electrical]: 'W', [contact]: 'N', [lifting]: 'N', [torque]: 'N m', [jointState]: 'N m'});
// All of them are there to choose from, contacts from when they press: after the first step.
await page.click('#step');
await offered(until, names);
for (const name of names) await add(page, name);
const recorder = await recording('seen.mcap', '2');
const controller = await start('takt-controller', [program, ...patient]);
await page.click('#play');
assert.equal(await recorder.ended, 0, recorder.text);
await page.click('#pause');
await until(() => takt.last.status.state === 2);
const heard = exported('seen.mcap');
const state = takt('state');
await until((step) => takt.last.state.step === BigInt(step), state.step);
await until(([wanted, time]) => wanted.every((name) => Math.abs(takt.plots.numbers(name).x.at(-1) - time) < 1e-6), [names, state.time]);
await drawn(ask);
const plots = {};
for (const name of names) {
  plots[name] = await read(ask, name);
  assert.ok(plots[name].x.length > 20, `${name}: ${plots[name].x.length} numbers`);
  assertDrawn(name, plots[name]);
}
const recordedPair = ({contacts}) => contacts.find((one) => one.base === 'P' && one.target === 'Table1');
compare(electrical, plots[electrical], heard('power', ({consumers}) => consumers.Robot1.electrical_power));
compare(contact, plots[contact], heard('contacts', (sample) => recordedPair(sample).normal_force));
compare(lifting, plots[lifting], heard('contacts', (sample) => recordedPair(sample).force.z));
compare(torque, plots[torque], heard('state', (sample) => sample.robots.Robot1.effort.shoulder_lift_joint));
// Where the cell stands now, of all of them.
assert.equal(plots[electrical].y.at(-1), takt('power').consumers.Robot1.electrical_power);
assert.equal(plots[contact].y.at(-1), takt('contacts').contacts.find((one) => one.base === 'P' && one.target === 'Table1').normal_force);
assert.equal(plots[torque].y.at(-1), state.robots.Robot1.effort.shoulder_lift_joint);
assert.equal(plots[jointState].y.at(-1), state.robots.Robot1.effort.shoulder_lift_joint);
// The Part on the table presses with its weight, 0.3 kg; the arm works against gravity; a robot at LoD 2 or 3 draws power.
assert.ok(Math.abs(plots[contact].y.at(-1) - 0.3 * 9.80665) < 0.02, `${plots[contact].y.at(-1)} N`);
assert.ok(Math.max(...plots[torque].y) - Math.min(...plots[torque].y) > 1, 'the torque of a moving arm changes');
assert.ok(Math.min(...plots[electrical].y) > 50);

stage('a pair that presses no longer');
// Its plot goes on without a number, and with numbers again when the part is back. A cell that stands is shown as it was
// changed.
await stop(controller);
const [x, y, z] = ['x', 'y', 'z'].map((axis) => String(state.components.P.position[axis]));
const numbers = plots[contact].y.length, before = plots[torque].y.length;
takt('move', 'P', '--at', x, y, '1.5', '--velocity', '0', '0', '0');
await page.click('#step');
await until((name) => takt.plots.numbers(name).y.at(-1) === null, contact);
takt('step', '20');
const lifted = takt('state');
await until(([wanted, time]) => wanted.every((name) => takt.plots.numbers(name).x.at(-1) === time), [[contact, torque], lifted.time]);
await drawn(ask);
const gap = await read(ask, contact);
assert.equal(gap.newest, 'none');
assert.deepEqual(gap.chart, [gap.x, gap.y]);
assert.ok(gap.y.slice(0, numbers - 1).every((value) => value !== null));
assert.ok((await read(ask, torque)).y.slice(before).every((value) => value !== null));
takt('move', 'P', '--at', x, y, z, '--velocity', '0', '0', '0');
takt('step', '100');
const stands = takt('state');
await until(([name, time]) => takt.plots.numbers(name).x.at(-1) === time, [contact, stands.time]);
await drawn(ask);
const again = await read(ask, contact);
assertDrawn(contact, again);
assert.ok(again.y.includes(null));
assert.equal(again.y.at(-1), takt('contacts').contacts.find((one) => one.base === 'P' && one.target === 'Table1').normal_force);

stage('reset');
// After a reset all plots start at time zero, whether or not their topic has an epoch.
await page.click('#reset');
await until(() => takt.last.state.epoch === 1 && takt.last.state.time === 0);
await page.click('#play');
await filled(until, names, 20);
assert.ok(await ask(() => [...takt.plots.tracks.values()].every(({x}) => x[0] < 0.5 && x.every((value, i) => i === 0 || value > x[i - 1]))));

stage('one instant of two topics');
// Joint states have their time in whole nanoseconds, a state has it as a number: the axis of times is one that has ticks.
await page.click('#pause');
await until(() => takt.last.status.state === 2);
const span = await ask(([one, other]) => {
  const {plots} = takt, column = (name) => plots.tracks.get(name.slice(0, name.indexOf('.')));
  plots.clear();
  column(one).take(0.30400000000000005, new Map([[one, 1]]));
  column(other).take(0.304, new Map([[other, 1]]));
  Object.assign(plots, {dirty: true, drawn: 0});
  plots.draw();
  const {min, max} = plots.plots[0].chart.scales.x;
  return max - min;
}, [torque, jointState]);
assert.ok(span >= 1e-4, `${span} s`);
assert.deepEqual(problems, []);
await page.context().close();
await stop(running);
await stop(bridge);

stage('temperature');
// A rotor core put into the furnace, which is hot.
const furnace = await start('takt-server', [`${sources}/config/scenarios/furnace.yaml`, '--cell', process.env.TAKT_CELL, '--paused']);
const {child: second, url: oven} = await view();
const kitchen = await visit(browser, oven, small, {deviceScaleFactor: ALL_PIXELS});
takt('move', 'Rotor', '--at', '1.15', '0', '0.4');
const heat = 'state.devices.Rotor_heat.signals.temperature', air = 'state.devices.Furnace.signals.air_temperature';
await offered(kitchen.until, [heat, air]);
Object.assign(UNITS, {[heat]: 'degC', [air]: 'degC'});
for (const name of [heat, air]) await add(kitchen.page, name);
const second_recorder = await recording('oven.mcap', '600');
await kitchen.page.fill('#factor', '200');
await kitchen.page.locator('#factor').blur();
await kitchen.page.click('#play');
assert.equal(await second_recorder.ended, 0, second_recorder.text);
await filled(kitchen.until, [heat, air], 30);
await kitchen.page.click('#pause');
await kitchen.until(() => takt.last.status.state === 2);
await drawn(kitchen.ask);
const samples = exported('oven.mcap');
for (const [name, device, signal] of [[heat, 'Rotor_heat', 'temperature'], [air, 'Furnace', 'air_temperature']]) {
  const plot = await read(kitchen.ask, name);
  assertDrawn(name, plot);
  compare(name, plot, samples('state', ({devices}) => devices[device].signals[signal]));
  if (name === heat) {
    assert.equal(plot.y[0], 20);
    assert.ok(plot.y.every((value, n) => n === 0 || value > plot.y[n - 1]) && plot.y.at(-1) < 300, 'it gets warmer, never as warm as the air');
  }
}
assert.deepEqual(kitchen.problems, []);
await browser.close();
await stop(second);
await stop(furnace);
console.log('plots have the numbers of DDS, before and after a reset');
process.exit(0);
