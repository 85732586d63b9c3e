// A recording read by the MCAP project's own reader, its samples by Foxglove's: recording.mjs FILE EXPECTED.json COMPRESSION
// EXPECTED.json is what `takt export FILE --json` says of the same file, one document a line.
import {readFile, open} from 'node:fs/promises';
import {strict as assert} from 'node:assert';
import {McapIndexedReader, McapStreamReader} from '@mcap/core';
import {parse} from '@foxglove/rosmsg';
import {MessageReader} from '@foxglove/rosmsg2-serialization';
import {decompress} from 'fzstd';
import lz4 from '@foxglove/wasm-lz4';

const [file, expectedFile, compression] = process.argv.slice(2);
await lz4.isLoaded;
const decompressHandlers = {zstd: (bytes, size) => decompress(bytes, new Uint8Array(Number(size))), lz4: (bytes, size) => lz4(bytes, Number(size))};
const handle = await open(file);
const readable = {
  size: async () => BigInt((await handle.stat()).size),
  read: async (offset, size) => {
    const bytes = new Uint8Array(Number(size));
    await handle.read(bytes, 0, bytes.length, Number(offset));
    return bytes;
  },
};
const indexed = await McapIndexedReader.Initialize({readable, decompressHandlers});
assert.equal(indexed.header.profile, 'ros2');
const readers = new Map();
for (const channel of indexed.channelsById.values()) {
  const schema = indexed.schemasById.get(channel.schemaId);
  assert.equal(schema.encoding, 'ros2msg');
  assert.equal(channel.messageEncoding, 'cdr');
  // For rosbag2: instants are sent best effort, and what late joiners need is latched.
  const [, reliability, durability] = channel.metadata.get('offered_qos_profiles').match(/^- history: 3\n[^]*\n {2}reliability: ([12])\n {2}durability: ([12])\n/);
  assert.equal(reliability, /\/(state|power|contacts)$/.test(channel.topic) ? '2' : '1', channel.topic);
  assert.equal(durability, /\/(description|status|tf_static)$/.test(channel.topic) ? '1' : '2', channel.topic);
  readers.set(channel.id, new MessageReader(parse(new TextDecoder().decode(schema.data), {ros2: true})));
}

// Numbers of 64 bits come as BigInt, 32-bit floats as doubles on both sides.
const plain = (value) => (typeof value === 'bigint' ? Number(value) : value);

// `takt export` writes names where the sample has numbers: of elements of lists, of indices, of enumerations.
let description = null;
const indexOf = {partner: 'components', part: 'components', base: 'components', target: 'components', palm: 'components',
  left_jaw: 'components', right_jaw: 'components', mounted_on: 'components', robot: 'robots'};
const numbers = new Map();  // of each name of an enumeration
const renamed = (key) => (key === 'nsec' ? 'nanosec' : key);
// of: the described thing that the sample belongs to.
function compare(sample, said, way, of) {
  const field = way.at(-1), place = way.join('.');
  if (Array.isArray(sample) || ArrayBuffer.isView(sample)) {
    const list = Array.from(sample), order = description?.[field] ?? of?.joints ?? of?.signals;
    assert.equal(Object.keys(said).length, list.length, place);
    list.forEach((element, i) => {
      if (Array.isArray(said)) return compare(element, said[i], [...way, i], of);
      const key = ['name', 'target'].find((member) => typeof element[member] === 'string');
      const name = key ? element[key] : order[i].name;
      const {[key]: _, ...rest} = key ? element : {};
      compare(key ? rest : element, said[name], [...way, name], key ? element : order[i]);
    });
  } else if (sample && typeof sample === 'object') {
    assert.deepEqual(Object.keys(said).sort(), Object.keys(sample).map(renamed).sort(), place);
    for (const [key, member] of Object.entries(sample)) compare(member, said[renamed(key)], [...way, key], of);
  } else if (field === 'state_hash') {
    assert.equal(said, `0x${sample.toString(16).padStart(16, '0')}`);
  } else if (field in indexOf) {
    assert.equal(said, description[indexOf[field]][sample]?.name ?? null, place);
  } else if (typeof said === 'string' && typeof sample === 'number') {
    const name = `${field} ${said}`;
    if (!numbers.has(name)) numbers.set(name, sample);
    assert.equal(sample, numbers.get(name), place);
  } else {
    assert.equal(plain(sample), plain(said), place);
  }
}
const expected = (await readFile(expectedFile, 'utf8')).trim().split('\n').map((line) => JSON.parse(line));

let count = 0;
const topics = new Set();
for await (const message of indexed.readMessages()) {
  const channel = indexed.channelsById.get(message.channelId);
  const sample = readers.get(channel.id).readMessage(message.data);
  const same = expected[count];
  assert.equal(channel.topic, same.topic);
  assert.equal(Number(message.logTime), same.log_time_ns);
  if (channel.topic === '/cell/description') description = sample;
  compare(sample, same.sample, [`message ${count} on ${channel.topic}`]);
  topics.add(channel.topic);
  ++count;
}
assert.equal(count, expected.length);
assert.equal(BigInt(count), indexed.statistics.messageCount);
assert.ok(count > 0);
for (const {compression: used} of indexed.chunkIndexes) assert.equal(used, compression);
// The recording has the topics of a server that other programs need.
for (const topic of ['/tf', '/tf_static', '/cell/status', '/cell/description', '/cell/state', '/cell/events']) assert.ok(topics.has(topic), topic);

// From its begin to its end, as a program reads it that cannot seek, all checksums checked.
const stream = new McapStreamReader({decompressHandlers, validateCrcs: true});
stream.append(await readFile(file));
let streamed = 0, chunks = 0, indices = 0;
for (let record; (record = stream.nextRecord()); ) {
  if (record.type === 'Message') ++streamed;
  if (record.type === 'Chunk') ++chunks;
  if (record.type === 'ChunkIndex') ++indices;
}
assert.ok(stream.done());
assert.equal(streamed, count);
assert.equal(indices, indexed.statistics.chunkCount);
console.log(`${count} messages of ${topics.size} topics in ${indices} chunks read by @mcap/core`);
