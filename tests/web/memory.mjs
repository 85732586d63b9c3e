// What the page of takt view remembers and computes, without a browser: samples of the past, curves with their gaps, events that
// repeat, files of plots, and colours that users with colour blindness can tell apart.
import {strict as assert} from 'node:assert';
import {existsSync, readFileSync} from 'node:fs';
import {sources} from './processes.mjs';

const page = `${process.env.TAKT_BIN}/../client_lib/view/web`;
if (!existsSync(`${page}/messages.js`) || !existsSync(`${page}/track.js`)) {
  console.log('skipped: the page was not built, since npm could not be reached');
  process.exit(77);
}
const {Past, Reel} = await import(`${page}/past.js`);
const {Track} = await import(`${page}/track.js`);
const {Events, gathered, saying} = await import(`${page}/events.js`);
const {csvOf, svgOf} = await import(`${page}/curve_export.js`);
const {Signals, levelsOf} = await import(`${page}/signals.js`);
const {TimeWindow} = await import(`${page}/time_window.js`);
const {Scale, quantity, roundDown, roundUp, PRESSURE} = await import(`${page}/scales.js`);
const {addressed} = await import(`${page}/address.js`);
const {Measured} = await import(`${page}/quality.js`);
const {cover, shadows} = await import(`${page}/shadows.js`);
const {isSolid} = await import(`${page}/solid.js`);
const THREE = await import(`${page}/node_modules/three/build/three.module.js`);
// The same numbers in each run of the test (Park and Miller 1988).
let seed = 1;
const random = () => (seed = (48271 * seed) % 2147483647) / 2147483647;

// --- the past: each sample comes back as it was, all bits of whole numbers too
const stateAt = (i, parts = 3) => ({
  time: 0.05 * i, step: BigInt(i), epoch: 0, scenario_generation: 1, state_hash: 0xfedcba9876543210n ^ BigInt(i),
  components: Array.from({length: parts}, (one, k) => ({position: {x: Math.sin(i + k), y: 1 / (i + 1), z: -k}, state: k % 3, partner: -1})),
  robots: [{position: Float64Array.from([Math.cos(i), i / 3]), motor_power: new Float64Array(i % 2)}], grippers: [{closed: i % 5 > 2, moving: false, width: 0.01 * i}],
  applied: [{target: 'Robot1', count: BigInt(i)}],
});
const reel = new Reel();
for (let i = 0; i < 200; ++i) assert.ok(reel.take(0.05 * i, stateAt(i), 50 * i));
for (let i = 0; i < 200; i += 7) assert.deepEqual(reel.at(0.05 * i + 0.01), stateAt(i));
assert.deepEqual(reel.at(-1), stateAt(0));
// One number of all of them, found by its place: of components, of joints, of whole numbers.
assert.deepEqual(reel.column((sample) => Number(sample.robots[0].position[1])).values, Array.from({length: 200}, (one, i) => i / 3));
assert.deepEqual(reel.column((sample) => Number(sample.step)).values, Array.from({length: 200}, (one, i) => i));
assert.deepEqual(reel.column((sample) => sample.robots[0].motor_power[0]).values, Array.from({length: 200}, (one, i) => (i % 2 ? 0 : null)));
// No more often than 20 times a second, and a standing cell that is changed is kept as it is changed to.
assert.ok(!reel.take(10.01, stateAt(201), 50 * 199 + 10));
assert.ok(reel.take(0.05 * 199, {...stateAt(199), components: []}, 50 * 199 + 10));
assert.deepEqual(reel.at(100).components, []);
// However long a cell runs: bounded memory, and the newest samples are those that stay.
const small = new Reel(100000);
for (let i = 0; i < 20000; ++i) small.take(0.05 * i, stateAt(i, 10), 200 * i);
assert.ok(small.bytes <= 100000 && small.frames.length > 50, `${small.bytes} bytes in ${small.frames.length} samples`);
assert.deepEqual(small.at(0.05 * 19999), stateAt(19999, 10));
assert.equal(small.bytes, small.frames.reduce((sum, {bytes}) => sum + bytes, 0));
const long = new Reel();
for (let i = 0; i < 10000; ++i) long.take(0.05 * i, {time: 0.05 * i}, 50 * i);
assert.ok(Math.abs(long.newest - long.first - 300) < 0.1, 'five minutes');
// Contacts of an instant are shown with its state alone; a reset forgets all.
let changes = 0;
const past = new Past(() => { ++changes; });
past.take(stateAt(1), null, 0);
past.takeContacts({time: 0.05, contacts: [{base: 1}]}, 0);
past.take(stateAt(2), null, 60);
past.show(0.05);
assert.deepEqual(past.shown.contacts, [{base: 1}]);
past.show(0.1);
assert.deepEqual(past.shown, {state: stateAt(2), contacts: []});
past.take({...stateAt(0), epoch: 1}, null, 200);
assert.equal(past.shown, null);
assert.equal(past.states.first, 0);
assert.equal(changes, 3);

// --- a curve of a recording that is played here and there: it joins exactly those samples between which it was played
for (let round = 0; round < 200; ++round) {
  const track = new Track(), played = new Set(), known = new Set();
  track.add('a');
  for (let part = 0; part < 6; ++part) {
    track.jump();
    let time = Math.floor(100 * random()), before = null;
    for (let n = 0; n < 3 + 20 * random(); ++n, time += 1 + Math.floor(3 * random())) {
      track.take(time, new Map([['a', time % 11]]));
      known.add(time);
      if (before !== null) for (let t = before; t < time; ++t) played.add(t);
      before = time;
    }
  }
  const times = [...known].sort((a, b) => a - b);
  assert.deepEqual(track.x, times);
  assert.deepEqual(track.columns.get('a'), times.map((time) => time % 11));
  const gaps = times.filter((time, i) => i > 0 && Array.from({length: time - times[i - 1]}, (one, k) => times[i - 1] + k).some((t) => !played.has(t)));
  assert.deepEqual([...track.breaks].sort((a, b) => a - b), gaps);
}
const track = new Track(1000);
track.add('a');
for (let i = 0; i < 5000; ++i) track.take(i, new Map(i % 100 < 50 ? [['a', i]] : []));
assert.ok(track.x.length <= 1000);
assert.equal(track.at('a', 4949.5), 4949);
assert.equal(track.at('a', 4960), null);
// A curve that is added later has what another memory has of it; between those samples its numbers are not known.
track.fill('b', [4500.5, 4700], [1, 2]);
assert.deepEqual([track.at('b', 4400), track.at('b', 4600), track.at('b', 4999)], [undefined, 1, 2]);
assert.equal(track.columns.get('a').length, track.x.length);

// --- an address: a view comes back, any other text is none
const view = {camera: [1, 2, 3], target: [0, 0, 0], section: 'x', cut: 0.5, options: {forces: false}, plots: [['a']]};
assert.deepEqual(addressed(`#${encodeURIComponent(JSON.stringify(view))}`), view);
for (const text of ['', '#', '#%', '#null', '#7', '#[]', '#"x"', '#{"camera": 7}', '#{"camera": [1, 2], "target": [1, 2, 3]}', '#{"camera": [1, 2, null], "target": [0, 0, 0]}', '#{"camera": [0, 0, 0], "target": [0, 0, 0]}', '#{"camera": {"x": 1}, "options": 3, "plots": "a", "section": "w", "cut": {}}'])
  assert.deepEqual(addressed(text), {section: '', cut: 0, options: {}, plots: undefined}, text);

// --- events that repeat
const event = (n, message, more = {}) => ({sequence_number: BigInt(n), time: n, severity: 1, code: 'weak_grip', subject: 'Gripper1', message, ...more});
const heard = [event(1, 'Gripper1 presses with 3.25 N.'), event(2, 'P: Gripper1 -> Gripper2', {severity: 0, code: 'c', subject: 'P'}), event(3, 'Gripper1 presses with 1e-3 N.'),
  event(4, 'P: Gripper2 -> Gripper1', {severity: 0, code: 'c', subject: 'P'}), event(5, 'Gripper1 presses with -4 N.'), event(30, 'Gripper1 presses with 3 N.')];
assert.deepEqual(gathered(heard).map(saying), ['P: Gripper1 -> Gripper2', 'P: Gripper2 -> Gripper1', '3 × Gripper1 presses with -4 N.', 'Gripper1 presses with 3 N.']);
const events = new Events(null, null);
for (const one of heard) assert.ok(events.take(one, 0, true));
for (const one of heard) assert.ok(!events.take(one, 0, true), 'a recording has its events again');
assert.deepEqual(events.all.map(({sequence_number: n}) => Number(n)), [1, 2, 3, 4, 5, 30]);
assert.ok(events.take(event(1, 'started again'), 0, false));
assert.equal(events.all.length, 1);

// --- the part of a range of times: within it whatever is done, as wide as it was zoomed, and the time at the pointer keeps its place
const part = new TimeWindow();
const close = (a, b, what) => assert.ok(Math.abs(a - b) < 1e-9 * (1 + Math.abs(b)), `${what}: ${a}, ${b}`);
for (let round = 0, last = 10; round < 5000; ++round) {
  const {from, to} = part, wide = to - from, draw = random();
  if (draw < 0.3) {
    const factor = 0.5 + random(), share = random(), at = from + share * wide;
    part.scale(factor, at);
    if (part.from > part.first + 1e-6 && part.to < part.last - 1e-6 && part.to - part.from > 0.021) { close((at - part.from) / (part.to - part.from), share, 'share'); close(part.to - part.from, wide * factor, 'width'); }
  } else if (draw < 0.5) { part.move((random() - 0.5) * wide); close(part.to - part.from, wide, 'a move keeps the width'); }
  else if (draw < 0.7) { part.within(Math.max(part.first, last - 30), last += random()); if (part.partial && part.end === null) assert.equal(part.to, last); }
  else if (draw < 0.8) { const time = part.first + random() * (part.last - part.first); part.reach(time); assert.ok(time >= part.from - 1e-9 && time <= part.to + 1e-9, `${time} in ${part.from}..${part.to}`); }
  else if (draw < 0.9) part.hold(); else if (draw < 0.97) part.follow(); else part.fit();
  assert.ok(part.from >= part.first - 1e-9 && part.to <= part.last + 1e-9 && part.to > part.from, `${part.from}..${part.to} of ${part.first}..${part.last}`);
}
part.fit();
assert.deepEqual([part.from, part.to], [part.first, part.last]);

// --- quality: drafts where full pictures are slow, and none where they are fast, though some few are not
const pace = new Measured(), slowOnes = (kind, ...times) => times.map((time) => { pace.take(kind, time); return pace.slow; });
for (let n = 0; n < 2000; ++n) {  // one of three takes long, but never three of five
  pace.take('full', n % 3 === 0 ? 400 : 1 + 48 * random());
  assert.ok(!pace.slow, `full picture ${n}`);
}
assert.deepEqual(slowOnes('full', 60, 60, 60, 60, 60).at(-1), true);
assert.deepEqual(slowOnes('draft', 30, 30, 30, 30, 30, 5, 30, 5, 30), Array(9).fill(true));
assert.deepEqual(slowOnes('draft', 5), [false]);  // the processor is free again
assert.deepEqual(slowOnes('full', 400, 400, 400, 400, 400), [false, false, false, false, true]);
assert.deepEqual(slowOnes('full', 10, 10, 10), [true, true, false]);

// --- solids: what has no hole and its inside behind its faces
const shapes = [new THREE.BoxGeometry(1, 2, 3), new THREE.CylinderGeometry(1, 1, 2, 30), new THREE.SphereGeometry(0.01), new THREE.TorusGeometry(2, 0.3), new THREE.BoxGeometry().toNonIndexed()];
assert.deepEqual(shapes.map(isSolid), shapes.map(() => true));
const without = (shape, from, count) => { const {array} = shape.index; shape.setIndex([...array.slice(0, from), ...array.slice(from + count)]); return shape; };
const turned = (shape, to) => { const {array} = shape.index; for (let i = 0; i < Math.min(to, array.length); i += 3) [array[i], array[i + 1]] = [array[i + 1], array[i]]; return shape; };
const others = [new THREE.PlaneGeometry(), new THREE.CylinderGeometry(1, 1, 2, 30, 1, true), without(new THREE.BoxGeometry(), 6, 3), turned(new THREE.BoxGeometry(), 3), turned(new THREE.SphereGeometry(), Infinity), new THREE.BufferGeometry().setAttribute('position', new THREE.Float32BufferAttribute([], 3))];
assert.deepEqual(others.map(isSolid), others.map(() => false));

// --- shadows: of a cube of 1 m, from light at 2 : 1 along x, the floor has the outline; it is the same until the cube moves
const world = new THREE.Group(), cube = new THREE.Mesh(new THREE.BoxGeometry(1, 1, 1), new THREE.MeshBasicMaterial()), floor = new THREE.Mesh(), sun = new THREE.DirectionalLight();
cube.castShadow = true;
cube.position.set(0.5, 0.5, 0.5);
world.add(cube, new THREE.Mesh(new THREE.BoxGeometry(9, 9, 9)));
sun.position.set(1, 0, 2);
world.updateMatrixWorld();
cover(floor, world, 0, sun, 0.01);
floor.geometry.computeBoundingBox();
assert.deepEqual([...floor.geometry.boundingBox.min.toArray(), ...floor.geometry.boundingBox.max.toArray()].map((value) => Number(value.toFixed(6))), [-0.51, -0.01, 0, 1.01, 1.01, 0]);
const cast = shadows(world);
assert.deepEqual(shadows(world), cast);
for (const change of [() => { cube.position.x += 1e-6; }, () => { cube.rotation.z = 1e-6; }, () => { cube.visible = false; }, () => { cube.visible = true; cube.geometry = new THREE.BoxGeometry(1, 1, 2); }]) {
  const before = shadows(world);
  change();
  world.updateMatrixWorld();
  assert.notDeepEqual(shadows(world), before, String(change));
}

// --- scales: round ends with units that do not flicker
assert.deepEqual([0.0012, 1, 1.01, 4.2, 7, 10, 150].map(roundUp), [0.002, 1, 2, 5, 10, 10, 200]);
assert.deepEqual([0.0012, 1, 1.01, 4.2, 7, 10, 150].map((value) => Number(roundDown(value).toPrecision(6))), [0.001, 1, 1, 2, 5, 10, 100]);
assert.deepEqual([0, 0.02, 5, 1500, 2.5e6].map((value) => quantity(value, 'Pa')), ['0 Pa', '20 mPa', '5 Pa', '1.5 kPa', '2.5 MPa']);
const scale = new Scale(PRESSURE, 'Pa'), ends = [3e5, 4.9e5, 2e5, 1.1e5, 0.9e5, NaN, 0, 6e5].map((value) => { scale.take(value); return scale.end; });
assert.deepEqual(ends, [5e5, 5e5, 5e5, 5e5, 1e5, 1e5, 1e5, 1e6]);
assert.equal(scale.text, '0 to 1 MPa');
assert.equal(scale.color(0).getHex(), PRESSURE.color(0).getHex());
assert.equal(scale.color(2e6).getHex(), PRESSURE.color(1).getHex());

// --- units: of the IDL, by the type of a joint and by the signal of a device
const signals = new Signals();
signals.describe({components: [{name: 'P'}], robots: [{name: 'R', joints: [{name: 'turns', type: 0}, {name: 'slides', type: 1}]}], grippers: [], devices: [{name: 'D', signals: [{name: 't', unit: 'degC'}, {name: 'on', unit: ''}]}]});
const units = {};
const collect = (name, value, unit) => { units[name] = unit; };
const v = {x: 0, y: 0, z: 0};
signals.each('state', 'takt_msgs/msg/CellState', {time: 0, components: [{position: v, torque: v}], robots: [{position: [0, 0], effort: [0, 0]}], grippers: [], devices: [{signals: [0, 0]}]}, collect);
signals.each('R/joint_states', 'sensor_msgs/msg/JointState', {name: ['turns', 'slides'], velocity: [0, 0]}, collect);
assert.deepEqual({...units}, {'state.time': 's', ...Object.fromEntries([['position', 'm'], ['torque', 'N m']].flatMap(([key, unit]) => ['x', 'y', 'z'].map((axis) => [`state.components.P.${key}.${axis}`, unit]))),
  'state.robots.R.position.turns': 'rad', 'state.robots.R.position.slides': 'm', 'state.robots.R.effort.turns': 'N m', 'state.robots.R.effort.slides': 'N', 'state.devices.D.signals.t': 'degC', 'state.devices.D.signals.on': '',
  'R/joint_states.velocity.turns': 'rad/s', 'R/joint_states.velocity.slides': 'm/s'});
const some = [];
signals.each('R/joint_states', 'sensor_msgs/msg/JointState', {name: ['turns', 'slides'], velocity: [3, 4]}, (name, value) => some.push([name, value]), ['R/joint_states.velocity.slides']);
assert.deepEqual(some, [['R/joint_states.velocity.slides', 4]]);
assert.deepEqual(levelsOf('R/joint_states.velocity.slides'), ['Joint states', 'R', 'velocity', 'slides']);

// --- files
const curves = [{name: 'a,"b"', unit: 'm', label: 'a <b>', color: '#123456', dash: []}, {name: 'c', unit: '', label: 'c', color: '#654321', dash: [2, 3]}];
const data = [[0, 1, 2, 3], [1 / 3, 0.5, null, 2], [7, undefined, 8, 9]];
assert.equal(csvOf(curves, data, 0, 2.5), 'time [s],"a,""b"" [m]",c\n0,0.3333333333333333,7\n1,0.5,\n2,,8\n');
const paths = [...svgOf(curves, data, 0, 3, {ink: '#000', ground: '#fff', line: '#ccc'}).matchAll(/<path d="([^"]+)" fill="none"/g)].map(([, d]) => d.match(/[ML]/g).join(''));
assert.deepEqual(paths, ['MLM', 'MLL'], 'a gap where there is no number, none where the number is not known');

// --- colours: contrast with the ground (WCAG 2.1, 1.4.11: 3 at least), and apart from each other in CIELAB for three kinds of
// colour blindness (Machado, Oliveira, Fernandes 2009, severity 1)
const KINDS = {
  normal: [1, 0, 0, 0, 1, 0, 0, 0, 1],
  protanopia: [0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998],
  deuteranopia: [0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.01182, 0.04294, 0.968881],
  tritanopia: [1.255528, -0.076749, -0.178779, -0.078411, 0.930809, 0.147602, 0.004733, 0.691367, 0.3039],
};
const linear = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255).map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
const luminance = (hex) => linear(hex).reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
const lab = (hex, m) => {
  const c = linear(hex), seen = [0, 1, 2].map((i) => Math.min(Math.max(m[3 * i] * c[0] + m[3 * i + 1] * c[1] + m[3 * i + 2] * c[2], 0), 1));
  const xyz = [[0.4124564, 0.3575761, 0.1804375, 0.95047], [0.2126729, 0.7151522, 0.072175, 1], [0.0193339, 0.119192, 0.9503041, 1.08883]];
  const [x, y, z] = xyz.map(([a, b, d, white]) => (a * seen[0] + b * seen[1] + d * seen[2]) / white).map((t) => (t > (6 / 29) ** 3 ? Math.cbrt(t) : t / (3 * (6 / 29) ** 2) + 4 / 29));
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
};
const css = readFileSync(`${sources}/client_lib/view/web/style.css`, 'utf8');
let least = Infinity;
for (const [theme, block] of [['light', css.slice(css.indexOf(':root {'), css.indexOf(':root.wa-dark'))], ['dark', css.slice(css.indexOf(':root.wa-dark'), css.indexOf('* {'))]]) {
  const colors = [...block.matchAll(/--curve-\d: (#[0-9a-f]{6})/g)].map(([, hex]) => hex), ground = block.match(/--panel: (#[0-9a-f]{6})/)[1];
  assert.equal(colors.length, 6);
  for (const hex of colors) {
    const [low, high] = [luminance(hex), luminance(ground)].sort((a, b) => a - b), contrast = (high + 0.05) / (low + 0.05);
    assert.ok(contrast >= 3, `${theme}: ${hex} has a contrast of ${contrast.toFixed(2)}`);
  }
  for (const [kind, matrix] of Object.entries(KINDS))
    for (let i = 0; i < colors.length; ++i)
      for (let k = 0; k < i; ++k) {
        const [a, b] = [lab(colors[i], matrix), lab(colors[k], matrix)], apart = Math.hypot(...a.map((value, n) => value - b[n]));
        least = Math.min(least, apart);
        assert.ok(apart >= 12, `${theme}, ${kind}: ${colors[i]} and ${colors[k]} are ${apart.toFixed(1)} apart`);
      }
}
console.log(`samples, curves, events, units and files as expected; colours are ${least.toFixed(1)} apart at least`);
process.exit(0);
