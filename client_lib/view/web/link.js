// The connection to takt view: Foxglove's WebSocket protocol. It connects again by itself while the page is open.
import {parse} from '@foxglove/rosmsg';
import {MessageReader} from '@foxglove/rosmsg2-serialization';

const text = new TextDecoder(), bytes = new TextEncoder();
const equal = (one, other) => one.length === other?.length && one.every((value, i) => value === other[i]);

export class Link {
  // on: {open(info), closed(), channel(channel), sample(topic, sample, type, log, again)}; wants(channel): to be subscribed?
  // `again`: the sample is the last one of its topic once more, as a cell that stands sends it.
  constructor(url, on, wants) {
    Object.assign(this, {url, on, wants, calls: new Map(), nextCall: 1, wait: 250, received: 0});  // bytes
    this.connect();
  }

  connect() {
    this.channels = new Map();
    this.service = null;
    const socket = (this.socket = new WebSocket(this.url, ['foxglove.websocket.v1']));
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => { this.wait = 250; };
    socket.onmessage = ({data}) => {
      this.received += data.byteLength ?? data.length;
      if (typeof data === 'string') this.receiveText(JSON.parse(data)); else this.receiveBinary(data);
    };
    socket.onclose = () => {
      if (this.socket !== socket) return;
      for (const call of this.calls.values()) call.reject(new Error('the connection was lost'));
      this.calls.clear();
      this.on.closed();
      setTimeout(() => this.connect(), this.wait);
      this.wait = Math.min(2 * this.wait, 2000);
    };
  }

  receiveText(message) {
    if (message.op === 'serverInfo') this.on.open(message);
    if (message.op === 'advertise') {
      const subscriptions = [];
      for (const channel of message.channels) {
        if (channel.encoding === 'cdr') channel.reader = new MessageReader(parse(channel.schema, {ros2: true}));
        this.channels.set(channel.id, channel);
        if (this.wants(channel)) subscriptions.push({id: channel.id, channelId: channel.id});
      }
      if (subscriptions.length) this.say({op: 'subscribe', subscriptions});
    }
    if (message.op === 'advertiseServices') this.service = message.services.find((s) => s.name === '/control');
    if (message.op === 'serviceCallFailure') this.finish(message.callId, (call) => call.reject(new Error(message.message)));
  }

  receiveBinary(buffer) {
    const view = new DataView(buffer);
    if (view.getUint8(0) === 1) {
      const channel = this.channels.get(view.getUint32(1, true));  // subscriptions are numbered as channels
      if (!channel) return;
      const payload = new Uint8Array(buffer, 13), again = equal(payload, channel.payload);
      channel.payload = payload;
      const sample = channel.reader ? channel.reader.readMessage(payload) : JSON.parse(text.decode(payload));
      this.on.sample(channel.topic, sample, channel.schemaName, Number(view.getBigUint64(5, true)) / 1e9, again);
    } else if (view.getUint8(0) === 3) {
      const length = view.getUint32(9, true);
      const reply = JSON.parse(text.decode(new Uint8Array(buffer, 13 + length)));
      this.finish(view.getUint32(5, true), (call) => call.resolve(reply));
    }
  }

  finish(id, how) {
    const call = this.calls.get(id);
    this.calls.delete(id);
    if (call) how(call);
  }

  say(message) { this.socket.send(JSON.stringify(message)); }

  // A request of the control vocabulary; resolves to {result, message, values}.
  call(request, args = {}) {
    if (!this.service) return Promise.reject(new Error('observers may look, not touch'));
    const body = bytes.encode(JSON.stringify({request, arguments: args})), encoding = bytes.encode('json');
    const message = new Uint8Array(13 + encoding.length + body.length), view = new DataView(message.buffer);
    const id = this.nextCall++;
    view.setUint8(0, 2);
    view.setUint32(1, this.service.id, true);
    view.setUint32(5, id, true);
    view.setUint32(9, encoding.length, true);
    message.set(encoding, 13);
    message.set(body, 13 + encoding.length);
    this.socket.send(message);
    return new Promise((resolve, reject) => this.calls.set(id, {resolve, reject}));
  }
}
