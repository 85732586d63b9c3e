// takt-opcua browsed, read, written, stepped and subscribed to by node-opcua's client. The witness of writes is the cell:
// `takt signals` and `takt state`.
import {strict as assert} from 'node:assert';
import {existsSync, writeFileSync} from 'node:fs';
import {scenario, sources, start, stop, takt} from './processes.mjs';

const bin = process.env.TAKT_BIN, work = process.env.TAKT_WORK;
const skip = (why) => { console.log(`skipped: ${why}`); process.exit(77); };
if (!existsSync(`${bin}/../share/takt/opcua/takt-opcua.mjs`)) skip('npm could not be reached when takt was built');
// takt-opcua itself runs on Node.js 18: its packages are in one file.
const [major, minor] = process.versions.node.split('.').map(Number);
if (major < 20 || (major === 20 && minor < 19)) skip(`node-opcua's client needs Node.js 20.19; this is ${process.version}`);
process.env.XDG_CONFIG_HOME = `${work}/config`;  // of both sides: certificates
const {AttributeIds, DataType, StatusCodes, compareWithType, connect, constructEventFilter, later, until} = await import('./opcua_client.mjs');

// A slide with its safety device, a light barrier with a block in its beam, and a wired input.
const cell = `${work}/opcua.yaml`;
writeFileSync(cell, `takt_scenario: 1
name: opcua
parts:
  Block: {mesh: ${sources}/config/meshes/C.obj, mass_kg: 0.5, hierarchy: 1, pose: {position_m: [0, 0, 0.7]}}
grounds:
  Table: {mesh: ${sources}/config/meshes/table.obj, convex: objects, pose: {position_m: [0, 0, 0.7]}}
robots:
  Slide: {urdf: ${sources}/config/robots/press.urdf, pose: {position_m: [0, 0, 1.33]}, initial_joints_rad: [0.3]}
grippers:
  Head: {robot: Slide, body_mesh: ${sources}/config/meshes/gripper_body.obj, jaw_mesh: ${sources}/config/meshes/gripper_jaw.obj,
    max_width_m: 0.150, jaw_speed_m_per_s: 0.075, max_force_N: 150, mass_kg: 3}
safety:
  Guard: {override_ramp_s: 0.5}
light_barriers:
  Barrier: {from_m: [-0.5, 0, 1.2], to_m: [0.5, 0, 1.2]}
force_torque_sensors:
  Wrist: {robot: Slide}
wires:
  Wrist.tare: Barrier.blocked
`);
const serve = (...more) => start('takt-server', [cell, '--paused', '--cell', process.env.TAKT_CELL, ...more], 'ready');
async function gateway(...more) {
  const child = await start('takt-opcua', ['--port', '0', ...more], 'Listens');
  const port = child.text.match(/Listens on opc\.tcp:\/\/[^:]*:(\d+)/)[1];
  return {child, url: `opc.tcp://127.0.0.1:${port}`};
}
const signals = () => Object.fromEntries(takt('signals').map((one) => [one.name, one]));

// --- before there is a cell
const {child, url} = await gateway();
const plc = await connect(url);
assert.equal(await plc.value('/simulation/Connected'), false);
assert.equal(await plc.status('/simulation/Time'), 'BadWaitingForInitialData');
assert.equal((await plc.call('Step', ['UInt32', 1])).status, 'BadNoCommunication');
assert.equal(await plc.status('Guard.released'), 'BadNodeIdUnknown');

// --- every signal of the cell, under its name
let server = await serve();
await until('the cell', async () => (await plc.status('Guard.released')) === 'Good');
assert.equal(await plc.value('/simulation/Connected'), true);
const owners = (await plc.children('/cell')).filter(({nodeClass}) => nodeClass === 1).map(({browseName}) => browseName.name);
for (const owner of ['Simulation', 'Slide', 'Head', 'Guard', 'Barrier', 'Wrist']) assert.ok(owners.includes(owner), `${owner} is not in ${owners}`);
const types = {Guard: {speed: 'Double', released: 'Boolean'}, Head: {part: 'Int32', width: 'Double', close: 'Boolean'}};
for (const [name, {value, direction, wire}] of Object.entries(signals())) {
  const shown = await plc.value(name);
  if (value !== null) assert.ok(Number(shown) === value, `${name}: ${shown} is not ${value}`);
  const access = (await plc.read(name, AttributeIds.AccessLevel)).value.value;
  assert.equal((access & 2) !== 0, direction === 'in' && wire === '', `${name}: access level ${access}`);
}
for (const [owner, of] of Object.entries(types))
  for (const [name, type] of Object.entries(of)) assert.equal((await plc.read(`${owner}.${name}`, AttributeIds.DataType)).value.value.toString(), `ns=0;i=${DataType[type]}`, name);
// Units by UNECE codes: the identifier of METRE is published as 5067858, of PERCENT as 20529 (OPC Foundation, UNECE_to_OPCUA.csv).
const unit = await plc.value('Guard.speed_override/EngineeringUnits');
assert.deepEqual([unit.unitId, unit.displayName.text, unit.namespaceUri], [20529, '%', 'http://www.opcfoundation.org/UA/units/un/cefact']);
assert.equal((await plc.value('Head.width/EngineeringUnits')).unitId, 5067858);
const range = await plc.value('Guard.speed_override/EURange');
assert.deepEqual([range.low, range.high], [0, 100]);
assert.equal(await plc.value('Wrist.tare/Wire'), 'Barrier.blocked');

// --- writes: all of one request together, or the reason
assert.deepEqual(await plc.write({'Guard.speed_override': ['Double', 50], 'Guard.door_closed': ['Boolean', false]}), ['Good', 'Good']);
assert.equal(signals()['Guard.speed_override'].value, 50);
assert.equal(signals()['Guard.door_closed'].value, 0);
await until('the override', async () => (await plc.value('Guard.speed_override')) === 50);
assert.deepEqual(await plc.write({
  'Guard.speed': ['Double', 1], 'Wrist.tare': ['Boolean', true], 'Guard.speed_override': ['String', 'fast'], 'Guard.reset': ['Double', 1], 'Guard.window': ['Boolean', true],
}), ['BadNotWritable', 'BadNotWritable', 'BadTypeMismatch', 'BadTypeMismatch', 'BadNodeIdUnknown']);
for (const number of [100.5, -1, NaN, Infinity]) assert.deepEqual(await plc.write({'Guard.speed_override': ['Double', number]}), ['BadOutOfRange'], String(number));
const [doubtful] = await plc.session.write([{nodeId: plc.id('Guard.speed_override'), attributeId: AttributeIds.Value, value: {statusCode: StatusCodes.BadSensorFailure, value: {dataType: DataType.Double, value: 70}}}]);
assert.equal(doubtful.name, 'BadWriteNotSupported');
assert.equal(signals()['Guard.speed_override'].value, 50);
assert.deepEqual(await plc.write({'Guard.door_closed': ['Boolean', true], 'Guard.speed_override': ['Double', 100]}), ['Good', 'Good']);
assert.deepEqual(await plc.call('Reset'), {status: 'Good', outputs: []});

// --- a test master steps: after Step the values are those of the instant. The override follows its input by 100 % in 0.5 s.
const size = await plc.value('/simulation/StepSize');
await plc.write({'Guard.speed_override': ['Double', 50]});
const ramp = Math.round(0.1 / size);
const stepped = await plc.call('Step', ['UInt32', ramp]);
assert.equal(stepped.status, 'Good');
assert.equal(await plc.number('/simulation/Steps'), ramp);
assert.ok(Math.abs(stepped.outputs[1] - ramp * size) < 1e-9);
assert.equal(await plc.value('/simulation/Time'), stepped.outputs[1]);
const speed = await plc.value('Guard.speed');
assert.ok(Math.abs(speed - 80) <= 100 * size / 0.5 + 1e-9, `the override is ${speed} % 0.1 s after a change from 100 to 50 %`);
assert.equal(signals()['Guard.speed'].value, speed);
for (let i = 1; i <= 20; ++i) {
  await plc.call('Step', ['UInt32', 1]);
  assert.equal(await plc.number('/simulation/Steps'), ramp + i);
}
assert.equal((await plc.call('Step', ['UInt32', 0])).status, 'BadOutOfRange');
assert.equal((await plc.call('SetState', ['Int32', 7])).status, 'BadOutOfRange');
assert.equal((await plc.call('SetPace', ['Int32', 0], ['Double', -1])).status, 'BadOutOfRange');
assert.notEqual((await plc.call('Step', ['String', 'one'])).status, 'Good');
assert.equal((await plc.call('SetPace', ['Int32', 0], ['Double', 0.5])).status, 'Good');
assert.equal(takt('status').pace_factor, 0.5);
assert.equal((await plc.call('SetState', ['Int32', 1])).status, 'Good');
assert.equal(await plc.value('/simulation/State'), 1);
assert.equal((await plc.call('Step', ['UInt32', 1])).status, 'BadInvalidState');
assert.equal((await plc.call('SetState', ['Int32', 2])).status, 'Good');
assert.equal(takt('status').state, 'paused');

// --- a monitored item gets each change, and OPC 40010 has the stop
const subscription = await plc.session.createSubscription2({requestedPublishingInterval: 50, requestedLifetimeCount: 1000, requestedMaxKeepAliveCount: 10, maxNotificationsPerPublish: 100, publishingEnabled: true, priority: 1});
const changes = [];
const item = await subscription.monitor({nodeId: plc.id('Guard.released'), attributeId: AttributeIds.Value}, {samplingInterval: 0, discardOldest: true, queueSize: 10}, 3);
item.on('changed', ({value, statusCode}) => changes.push(`${value.value} ${statusCode.name}`));
await until('the first value', () => changes.length > 0);
const stopNode = plc.id('/robotics-SafetyStates-SafetyState-ParameterSet-EmergencyStop');
assert.equal(await plc.value(stopNode), false);
await plc.write({'Guard.emergency_stop': ['Boolean', true]});
await plc.call('Step', ['UInt32', 2]);
assert.equal(await plc.value('Guard.released'), false);
assert.equal(await plc.value(stopNode), true);
await until('the change', () => changes.at(-1) === 'false Good');
assert.equal(changes[0], 'true Good');
// The cell has the last word: grippers stay as they are while it is stopped.
assert.deepEqual(await plc.write({'Head.close': ['Boolean', true]}), ['BadInvalidState']);
assert.equal(takt('state').grippers.Head.closed, false);
await plc.write({'Guard.emergency_stop': ['Boolean', false], 'Guard.reset': ['Boolean', true]});
await plc.call('Step', ['UInt32', 2]);
await until('the release', () => changes.at(-1) === 'true Good');
assert.deepEqual(await plc.write({'Head.close': ['Boolean', true]}), ['Good']);
await plc.call('Step', ['UInt32', 1]);
assert.equal(takt('state').grippers.Head.closed, true);
await until('the closed jaws', async () => (await plc.value('Head.closed')) === true);

// --- forced signals
takt('request', 'force_signal', 'signal=Barrier.blocked', 'value=1');
await until('the forced value', async () => (await plc.value('Barrier.blocked/Forced')) && (await plc.value('Barrier.blocked')));
takt('request', 'release_signal', 'signal=all');
await until('the release', async () => !(await plc.value('Barrier.blocked/Forced')) && !(await plc.value('Barrier.blocked')));

// --- OPC 40010-1: everything that the specification's types ask for is there, with a value or an honest status
const mandatory = [], gaps = [];
await compareWithType(plc.session, plc.id('/robotics'), 'system', (path, status) => mandatory.push([path, status]), (path) => gaps.push(path));
assert.deepEqual(gaps, []);
assert.ok(mandatory.length > 20, `${mandatory.length} mandatory variables`);
for (const [path, status] of mandatory) assert.ok(['Good', 'BadNotSupported'].includes(status), `${path}: ${status}`);
const axes = await plc.children('/robotics-MotionDevices-Slide-Axes');
assert.equal(axes.length, 1);
const joint = axes[0].browseName.name, position = `/robotics-MotionDevices-Slide-Axes-${joint}-ParameterSet-ActualPosition`;
const state = takt('state');
assert.equal(await plc.value(position), Object.values(state.robots.Slide.position)[0]);
assert.equal((await plc.value(`${position}-EngineeringUnits`)).unitId, 5067858);
assert.equal(await plc.value(`/robotics-MotionDevices-Slide-Axes-${joint}-MotionProfile`), 3);  // LINEAR

// --- the cell is killed: its last values stay, and say so; they go on when it is there again
const last = await plc.value('Guard.speed');
server.kill('SIGKILL');
await until('the loss', async () => (await plc.value('/simulation/Connected')) === false);
assert.equal(await plc.status('Guard.speed'), 'UncertainLastUsableValue');
assert.equal(await plc.value('Guard.speed'), last);
assert.equal(await plc.status(position), 'UncertainLastUsableValue');
assert.deepEqual(await plc.write({'Guard.speed_override': ['Double', 10]}), ['BadNoCommunication']);
assert.equal((await plc.call('Reset')).status, 'BadNoCommunication');
await until('the status of the item', () => changes.at(-1).endsWith('UncertainLastUsableValue'));
server = await serve();
await until('the cell again', async () => (await plc.status('Guard.speed')) === 'Good');
assert.equal(await plc.value('Guard.speed'), 100);
assert.deepEqual(await plc.write({'Guard.speed_override': ['Double', 10]}), ['Good']);
assert.equal(signals()['Guard.speed_override'].value, 10);

// --- another scenario: other nodes, and an event that says so
const events = [];
const monitor = await subscription.monitor({nodeId: 'i=2253', attributeId: AttributeIds.EventNotifier}, {
  samplingInterval: 0, discardOldest: true, queueSize: 100,
  filter: constructEventFilter(['EventType']),
}, 3);
monitor.on('changed', ([type]) => events.push(type.value.toString()));
await later();
takt('load', scenario);
await until('the nodes of the other scenario', async () => (await plc.status('Robot1.elbow_joint')) === 'Good');
assert.equal(await plc.status('Guard.speed'), 'BadNodeIdUnknown');
const elbow = takt('state').robots.Robot1.position.elbow_joint;
assert.equal(await plc.value('Robot1.elbow_joint'), elbow);
const turned = await plc.value('/robotics-MotionDevices-Robot1-Axes-elbow_joint-ParameterSet-ActualPosition');
assert.ok(Math.abs(turned - elbow * 180 / Math.PI) < 1e-9);
await until('GeneralModelChangeEventType', () => events.includes('ns=0;i=2133'));

// --- twenty clients, and observers, which change nothing
const many = await Promise.all(Array.from({length: 20}, () => connect(url)));
for (const one of many) assert.equal(await one.value('Robot1.elbow_joint'), elbow);
await Promise.all(many.map((one) => one.close()));
const watcher = await gateway('--observer');
const observer = await connect(watcher.url);
await until('the cell', async () => (await observer.status('Gripper1.close')) === 'Good');
assert.deepEqual(await observer.write({'Gripper1.close': ['Boolean', true]}), ['BadNotWritable']);
assert.ok(['BadUserAccessDenied', 'BadNotExecutable'].includes((await observer.call('Reset')).status));
assert.equal(takt('state').grippers.Gripper1.closed, false);
await observer.close();
assert.equal(await stop(watcher.child), 0);

await subscription.terminate();
await plc.close();
assert.equal(await stop(child), 0, child.text);
await stop(server);
console.log('a PLC reads, writes, steps and monitors the cell by OPC UA');
process.exit(0);
