// A running cell behind a bridge of its own: `takt view` on a free port of this machine, whose stream and requests it uses.
import {spawn} from 'node:child_process';
import {EventEmitter} from 'node:events';
import {existsSync} from 'node:fs';
import WebSocket from 'ws';
import {Link} from './link.js';
import {ControlResult} from './messages.js';

const SILENCE_MS = 3000;       // without a status, which the server sends ten times a second
const PATIENCE_MS = 5000;      // for a sample that follows the reply to a request
const VISIBLE_MS = 1000;       // for a state with an input that was set; a later command may have hidden it
const MOST_INPUTS = 64;        // of one request
const LARGEST_MESSAGE = 1 << 30;

class Socket extends WebSocket {
  constructor(url, protocols) {
    super(url, protocols, {maxPayload: LARGEST_MESSAGE});
    this.on('error', () => {});  // it closes, and the link connects again
  }
}
globalThis.WebSocket = Socket;

// Why a request was not executed; `kind`: lost, refused, not_found or incorrect_state.
export class CellError extends Error {
  constructor(kind, message) {
    super(message);
    this.kind = kind;
  }
}

// Events: description, state, status (each with the sample), found, lost, ended (the bridge, with a sentence).
export class Cell extends EventEmitter {
  constructor({program, options, name}) {
    super();
    this.setMaxListeners(0);  // each input that was set looks for its value
    Object.assign(this, {name, description: null, state: null, status: null, present: false, over: false, inputs: []});
    const arguments_ = ['--json', ...options, '--cell', name, 'view', '--port', '0', '--address', '127.0.0.1'];
    // The kernel ends the bridge with this process, however that ends.
    const setpriv = '/usr/bin/setpriv';
    const [command, ...before] = existsSync(setpriv) ? [setpriv, '--pdeathsig', 'TERM', program] : [program];
    this.bridge = spawn(command, [...before, ...arguments_], {stdio: ['ignore', 'pipe', 'pipe']});
    let said = '', problem = '';
    this.bridge.stderr.on('data', (data) => { problem = (problem + data).slice(-2000); process.stderr.write(data); });
    this.bridge.stdout.on('data', (data) => {
      if (this.link) return;
      said += data;
      if (said.includes('\n')) this.connect(JSON.parse(said).url.replace('http', 'ws'));
    });
    const ended = (why) => { if (!this.over) this.emit('ended', `the bridge 'takt view' ended: ${problem.trim() || why}`); };
    this.bridge.on('error', (error) => ended(error.message));
    this.bridge.on('exit', (code, signal) => ended(`exit ${code ?? signal}`));
    this.watch = setInterval(() => { if (Date.now() - this.heard > SILENCE_MS) this.lose(); }, SILENCE_MS / 10);
  }

  connect(url) {
    const wanted = Object.fromEntries(['description', 'state', 'status'].map((what) => [`/${this.name}/${what}`, what]));
    this.link = new Link(url, {
      open: () => {}, closed: () => this.lose(),
      sample: (topic, sample) => this.take(wanted[topic], sample),
    }, ({topic}) => topic in wanted);
  }

  take(what, sample) {
    if (what === 'status') {
      this.heard = Date.now();
      if (!this.present) {
        this.present = true;
        this.emit('found');
      }
    }
    // A state belongs to the description of its scenario; between the two samples there is none.
    if (what === 'description') this.state = null;
    if (what === 'state' && sample.scenario_generation !== this.description?.scenario_generation) return;
    this[what] = sample;
    this.emit(what, sample);
  }

  lose() {
    if (!this.present) return;
    this.present = false;
    this.emit('lost');
  }

  close() {
    this.over = true;
    clearInterval(this.watch);
    this.bridge.kill('SIGTERM');
  }

  // A request of the control vocabulary; resolves to the values of the reply, throws CellError.
  async request(name, args = {}) {
    if (!this.present) throw new CellError('lost', `The cell '${this.name}' does not answer.`);
    let reply;
    try {
      reply = await this.link.call(name, args);
    } catch (error) {
      throw new CellError('lost', error.message);
    }
    if (reply.result === ControlResult.ok) return reply.values;
    const kinds = {[ControlResult.not_found]: 'not_found', [ControlResult.incorrect_state]: 'incorrect_state'};
    throw new CellError(this.present ? kinds[reply.result] ?? 'refused' : 'lost', reply.message);
  }

  // Resolves when a sample fulfils the condition, the present one included; false when that takes too long.
  follows(what, condition, patience_ms = PATIENCE_MS) {
    if (this[what] && condition(this[what])) return Promise.resolve(true);
    return new Promise((resolve) => {
      const end = (result) => {
        this.off(what, look);
        clearTimeout(timer);
        resolve(result);
      };
      const look = (sample) => { if (condition(sample)) end(true); };
      const timer = setTimeout(() => end(false), patience_ms);
      this.on(what, look);
    });
  }

  // Takes steps, in portions of about a second: the bridge waits ten for a reply. Resolves when the state has them.
  async step(steps) {
    let values, left = steps, portion = 100;
    while (left > 0) {
      const taken = Math.min(portion, left), begun = Date.now();
      values = await this.request('step', {steps: taken});
      left -= taken;
      portion = Math.max(1, Math.round(taken * 1000 / Math.max(1, Date.now() - begun)));
    }
    await this.reached('state', ({step}) => step >= BigInt(values.step));
    return values;
  }

  // Gives an input a value. Inputs of one turn of the event loop go to the cell in one request, all or none; where the cell
  // refuses that, each has an answer of its own. Resolves when the state shows the value (`shows`: a condition), throws CellError.
  setInput(name, value, shows) {
    return new Promise((resolve, reject) => {
      if (this.inputs.push({name, value, shows, resolve, reject}) === 1) setImmediate(() => this.sendInputs(this.inputs.splice(0)));
    });
  }

  async sendInputs(inputs) {
    for (let i = MOST_INPUTS; i < inputs.length; i += MOST_INPUTS) await this.sendInputs(inputs.slice(i - MOST_INPUTS, i));
    const last = inputs.slice(MOST_INPUTS * Math.floor((inputs.length - 1) / MOST_INPUTS));
    try {
      await this.request('set_inputs', {inputs: last.map(({name}) => name), values: last.map(({value}) => value)});
    } catch (error) {
      if (last.length > 1 && error.kind === 'refused') for (const one of last) await this.sendInputs([one]);
      else for (const {reject} of last) reject(error);
      return;
    }
    for (const {shows, resolve} of last) this.follows('state', shows, VISIBLE_MS).then(resolve);
  }

  async reset() {
    const values = await this.request('reset');
    await this.reached('state', ({epoch}) => epoch >= values.epoch);
  }

  async setState(name, number) {
    await this.request('set_state', {state: name});
    await this.reached('status', ({state}) => state === number);
  }

  async setPace(name, number, factor) {
    await this.request('set_pace', {pace: name, factor});
    await this.reached('status', ({pace}) => pace === number);
  }

  async reached(what, condition) {
    if (!(await this.follows(what, condition))) throw new CellError('lost', `The request is executed, but its ${what} does not come.`);
  }
}
