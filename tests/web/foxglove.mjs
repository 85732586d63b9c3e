// The live stream read by Foxglove's own client, over both subprotocols.
import {strict as assert} from 'node:assert';
import ws from '@foxglove/ws-protocol';
import {parse} from '@foxglove/rosmsg';
import {MessageReader} from '@foxglove/rosmsg2-serialization';
import WebSocket from 'ws';
import {patient, program, server, start, stop, takt, view} from './processes.mjs';

const {FoxgloveClient} = ws;

const running = await server('--paused', '--lod', '3', '--set', 'solver.method=implicit');
const {child, url} = await view();
const controller = await start('takt-controller', [program, '--start', ...patient]);
const address = url.replace('http', 'ws');

async function look(protocol, headers = {}) {
  const client = new FoxgloveClient({ws: new WebSocket(address, [protocol], {headers})});
  const channels = new Map(), samples = new Map(), subscriptions = new Map();
  let info, services = [];
  const problems = [];
  client.on('serverInfo', (message) => { info = message; });
  client.on('advertise', (added) => added.forEach((channel) => channels.set(channel.topic, channel)));
  client.on('advertiseServices', (added) => { services = added; });
  client.on('error', (error) => problems.push(error));
  client.on('message', ({subscriptionId, data}) => {
    const channel = subscriptions.get(subscriptionId);
    if (channel.encoding !== 'cdr') return;
    channel.reader ??= new MessageReader(parse(channel.schema, {ros2: true}));
    samples.set(channel.topic, channel.reader.readMessage(data));
  });
  const until = (condition) => new Promise((resolve, reject) => {
    const begin = Date.now();
    const look = setInterval(() => {
      if (condition()) { clearInterval(look); resolve(); }
      else if (Date.now() - begin > 300000) { clearInterval(look); reject(new Error(`not come: ${condition}; there are ${[...channels.keys()]}; ${problems}`)); }
    }, 20);
  });
  return {client, channels, samples, until, info: () => info, services: () => services, problems,
    subscribe: (topic) => subscriptions.set(client.subscribe(channels.get(topic).id), channels.get(topic))};
}

for (const protocol of ['foxglove.websocket.v1', 'foxglove.sdk.v1']) {
  const live = await look(protocol);
  const wanted = ['/web_test/state', '/web_test/description', '/web_test/events', '/web_test/Robot1/joint_states', '/tf', '/takt/scene', '/takt/frames', '/takt/forces'];
  await live.until(() => live.info() && wanted.every((topic) => live.channels.has(topic)));
  assert.equal(live.info().name, 'web_test');
  wanted.forEach(live.subscribe);
  await live.until(() => live.samples.get('/web_test/state')?.time > 2 && wanted.every((topic) => live.samples.has(topic)));

  // While the cell is paused, the samples of takt view equal the output of takt state.
  await live.until(() => live.services().length === 1);
  const [service] = live.services();
  const replies = new Map();
  live.client.on('serviceCallResponse', (reply) => replies.set(reply.callId, JSON.parse(new TextDecoder().decode(reply.data))));
  let calls = 0;
  const call = async (request, args) => {
    const callId = ++calls;
    live.client.sendServiceCallRequest({serviceId: service.id, callId, encoding: 'json', data: new TextEncoder().encode(JSON.stringify({request, arguments: args}))});
    await live.until(() => replies.has(callId));
    return replies.get(callId);
  };
  assert.equal((await call('set_state', {state: 'paused'})).result, 1);
  const refused = await call('step', {steps: 'many'});
  assert.notEqual(refused.result, 1);
  assert.ok(refused.message.length > 10);
  const state = takt('state');
  await live.until(() => live.samples.get('/web_test/state').step === BigInt(state.step));
  const description = live.samples.get('/web_test/description');
  description.components.forEach(({name}, i) => {
    const {x, y, z} = live.samples.get('/web_test/state').components[i].position;
    assert.deepEqual({x, y, z}, state.components[name].position);
  });
  // Shapes are where the frames are, which are where the state says.
  await live.until(() => {
    const frame = live.samples.get('/takt/frames').transforms.find(({child_frame_id: id}) => id === 'takt/P');
    return Math.abs(frame.translation.z - state.components.P.position.z) < 1e-12 && Math.abs(frame.translation.x - state.components.P.position.x) < 1e-12;
  });
  const scene = live.samples.get('/takt/scene');
  const shape = scene.entities.find(({id}) => id === 'P');
  assert.equal(shape.frame_id, 'takt/P');
  assert.equal(3 * shape.triangles[0].points.length, description.components.find(({name}) => name === 'P').vertices.length);
  const length = (arrow) => arrow.shaft_length + arrow.head_length;
  const size = Math.hypot(...Object.values(state.components.P.force));
  await live.until(() => {
    const force = live.samples.get('/takt/forces').entities.find(({id}) => id === 'force on P');
    return force && Math.abs(length(force.arrows[0]) - 0.01 * size) < 1e-6;
  });
  // Elements that press, on request, as coloured triangles in the frame of their component.
  live.subscribe('/takt/pressures');
  assert.equal((await call('watch_pressures', {pairs: ['*-Table1'], duration: 60})).result, 1);
  await live.until(() => live.samples.get('/takt/pressures')?.entities.length > 0);
  for (const entity of live.samples.get('/takt/pressures').entities) {
    assert.match(entity.id, /^pressure .*Table1/);
    assert.ok(entity.frame_id.startsWith('takt/'));
    const [{points, colors}] = entity.triangles;
    assert.ok(points.length > 0 && points.length % 3 === 0 && colors.length === points.length);
    assert.ok(colors.some(({r, b}) => r > 0.85 && b < 0.15));
  }
  assert.equal((await call('set_state', {state: 'playing'})).result, 1);
  assert.deepEqual(live.problems, []);
  live.client.close();
}

// A page from elsewhere may look, not touch; one that asks for another host is turned away.
const foreign = await look('foxglove.websocket.v1', {origin: 'https://elsewhere.example'});
await foreign.until(() => foreign.info());
assert.equal(foreign.info().metadata.control, 'false');
foreign.client.sendServiceCallRequest({serviceId: 1, callId: 1, encoding: 'json', data: new TextEncoder().encode('{"request":"set_state","arguments":{"state":"paused"}}')});
await new Promise((resolve) => foreign.client.on('serviceCallFailure', resolve));
foreign.client.close();
const {request} = await import('node:http');
const {hostname, port} = new URL(url);
const code = await new Promise((resolve) => request({hostname, port, path: '/', headers: {host: 'rebound.example'}}, (response) => resolve(response.statusCode)).end());
assert.equal(code, 403);

// Invalid messages are answered with an error or ignored. Their sender and all other viewers continue.
const rude = await look('foxglove.websocket.v1');
await rude.until(() => rude.info() && rude.channels.has('/web_test/state'));
const socket = new WebSocket(address, ['foxglove.websocket.v1']);
await new Promise((resolve) => socket.on('open', resolve));
const answers = [];
socket.on('message', (data, binary) => { if (!binary) answers.push(JSON.parse(data)); });
const nonsense = ['', '{', '[]', 'null', '{"op": 7}', '{"op": "subscribe"}', '{"op": "subscribe", "subscriptions": [{"id": -1}]}',
  '{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 4000000000}]}', '{"op": "unsubscribe", "subscriptionIds": [12345]}',
  Buffer.from([]), Buffer.from([2]), Buffer.from([2, 1, 0, 0, 0, 1, 0, 0, 0, 255, 255, 255, 255]),
  Buffer.from([2, 1, 0, 0, 0, 9, 0, 0, 0, 4, 0, 0, 0, ...Buffer.from('json'), ...Buffer.from('{"request": [1]}')]), Buffer.from([99, 1, 2, 3])];
for (const message of nonsense) socket.send(message);
await rude.until(() => answers.some(({op, callId}) => op === 'serviceCallFailure' && callId === 9));
assert.ok(answers.some(({op, message}) => op === 'status' && message.includes('4000000000')));
rude.subscribe('/web_test/state');
await rude.until(() => rude.samples.has('/web_test/state'));
socket.close();
rude.client.close();

// Metrics are there, and of this cell.
const metrics = await (await fetch(`${url}metrics`)).text();
assert.match(metrics, /takt_up\{cell="web_test"\} 1/);
assert.match(metrics, /takt_state\{cell="web_test"\} [12]/);

await stop(controller);
await stop(running);
await stop(child);
console.log("Foxglove's client sees the cell over both subprotocols");
process.exit(0);
