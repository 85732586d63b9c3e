// The lower panel: curves, their tree, the timeline; the events of the cell, and the past that all of them show.
import {$} from './dom.js';
import {ComponentType, messages} from './messages.js';
import {csvOf, download, pngOf, svgOf} from './curve_export.js';
import {CurveTree} from './curve_tree.js';
import {Events} from './events.js';
import {Past} from './past.js';
import {Plots, labelOf} from './plots.js';
import {Programs} from './programs.js';
import {Signals} from './signals.js';
import {Timeline} from './timeline.js';
import {Track} from './track.js';

const GAP_S = 1;
const OFFERED = ['state', 'contacts', 'status'];
const JOINTS = 'sensor_msgs/msg/JointState', CONSUMER = 'takt_msgs/msg/PowerConsumer', STATE = 'takt_msgs/msg/CellState';
const numbersOf = (type, list) => Object.entries(messages[type]).filter(([, field]) => field.signal && !field.type && Boolean(field.list) === list).map(([key]) => key);

export class Lower {
  // seek(position): of a recording. tell(sentence). changed(): other curves. show(): another time is looked at.
  constructor({seek, tell, changed, show}) {
    Object.assign(this, {seek, tell, film: null, wanted: null, seeking: false, listed: new Map(), logs: new Map(), places: new Track()});
    this.places.add('log');
    this.signals = new Signals();
    this.programs = new Programs();
    this.past = new Past(() => { show(); this.badge(); });
    this.events = new Events($('events'), (event) => this.goEvent(event));
    this.tree = new CurveTree((name, apart) => this.add(name, apart));
    this.plots = new Plots($('plots'), {changed, picked: (time) => this.go(this.film ? this.positionOf(time) : time), unitOf: (name) => this.tree.names.get(name) ?? '',
      past: (name) => this.remembered(name), save: (plot, kind) => this.save(plot, kind)});
    this.timeline = new Timeline({go: (time) => this.go(time), eventTime: (event) => this.eventTime(event), stepTime: (time) => (this.film ? this.positionOf(time) : time)});
    $('live').onclick = () => this.past.leave();
    const tall = (height) => { const high = Math.max(Math.round(height), 90); $('bottom').style.setProperty('--low', `${high}px`); $('grip').setAttribute('aria-valuenow', high); };
    $('grip').onpointerdown = (event) => $('grip').setPointerCapture(event.pointerId);
    $('grip').onpointermove = (event) => { if ($('grip').hasPointerCapture(event.pointerId)) tall($('bottom').getBoundingClientRect().bottom - event.clientY); };
    $('grip').onkeydown = ({key}) => { if (key === 'ArrowUp' || key === 'ArrowDown') tall($('bottom').offsetHeight + (key === 'ArrowUp' ? 30 : -30)); };
    const drop = (event, plot) => { event.preventDefault(); event.stopPropagation(); this.plots.add(event.dataTransfer.getData('text/plain'), plot); };
    $('plots').addEventListener('dragover', (event) => event.preventDefault());
    $('plots').addEventListener('drop', (event) => drop(event, this.plots.plots.find(({holder}) => holder.contains(event.target))));
  }

  get state() { return this.past.shown?.state ?? this.newest; }

  open(film, observer) {
    this.film = film ? {first: 0, position: 0, duration: 0} : null;
    $('position').disabled = film && observer;
    this.events.clear();
    this.programs.clear();
    this.past.clear();
  }

  // --- names to choose from ---------------------------------------------------------------------------------------
  describe(description, asked) {
    this.signals.describe(description);
    this.plots.clear();
    this.listed.clear();
    this.tree.clear();
    const offer = (name, type, sample) => this.signals.each(name, type, sample, (full, value, unit) => this.tree.offer(full, unit));
    // Of topics that are received only while a plot needs them.
    for (const {name, joints} of description.robots) {
      const list = joints.map(() => 0);
      offer(`${name}/joint_states`, JOINTS, {name: joints.map(({name: joint}) => joint), ...Object.fromEntries(numbersOf(JOINTS, true).map((key) => [key, list]))});
    }
    const meters = (description.devices ?? []).filter(({signals}) => ['power', 'energy'].every((wanted) => signals.some(({name}) => name === wanted)));
    const consumers = [...description.robots, ...meters].map(({name}) => ({name, ...Object.fromEntries(numbersOf(CONSUMER, false).map((key) => [key, 0]))}));
    offer('power', 'takt_msgs/msg/Power', {consumers});
    this.tree.draw();
    // An address has names, or lists of them: a plot each. Its text may have any form.
    this.asked = Array.isArray(asked) ? asked.map((names) => [names].flat().filter((name) => typeof name === 'string')).filter(({length}) => length) : this.first(description).map((name) => [name]);
  }
  first({robots: [robot], components}) {
    const part = components.find(({type}) => type === ComponentType.part), chosen = [];
    if (robot?.joints.length) chosen.push(`state.robots.${robot.name}.position.${robot.joints[Math.min(1, robot.joints.length - 1)].name}`);
    if (part) chosen.push(`state.components.${part.name}.position.z`);
    return chosen;
  }
  // Once per topic, and whenever other pairs press.
  offerOf(name, type, sample) {
    if (!OFFERED.includes(name) || !this.signals.description) return;
    const key = name === 'contacts' ? sample.contacts.map(({base, target}) => `${base}-${target}`).join() : '';
    if (this.listed.get(name) === key) return;
    this.listed.set(name, key);
    let more = false;
    this.signals.each(name, type, sample, (full, value, unit) => { more = this.tree.offer(full, unit) || more; });
    if (more) this.tree.draw();
  }

  add(name, apart) {
    const plot = this.plots.add(name, apart ? null : this.plots.current);
    if (!plot) this.tell(`${name} is no name of a signal: choose one from the tree.`);
    else plot.holder.scrollIntoView({block: 'nearest'});
  }
  // The past of a curve that is added.
  remembered(name) {
    if (this.film || !name.startsWith('state.') || !this.past.states.frames.length) return null;
    return this.past.states.column((sample) => { let place; this.signals.each('state', STATE, sample, (full, value) => { place = value; }, [name]); return place; });
  }

  // --- samples ----------------------------------------------------------------------------------------------------
  // `log`: when it was recorded or received, s.
  sample(name, type, sample, log) {
    if (this.programs.take(name, sample)) return;
    const time = sample.time ?? stampOf(sample);
    if (this.film) this.follows(name, log);
    if (name === 'state') {
      this.newest = sample;
      if (this.film) this.places.take(time, new Map([['log', log]]));
      else this.past.take(sample, this.contacts, performance.now());
    }
    if (name === 'contacts') {
      this.contacts = sample;
      if (!this.film) this.past.takeContacts(sample, performance.now());
    }
    if ((name === 'events' || name === 'recorded_events') && this.events.take(sample, log, Boolean(this.film))) this.eventful = true;
    if (name === 'playback') this.play(sample, log);
    this.offerOf(name, type, sample);
    if (name === 'state' && this.asked && this.signals.description && !this.plots.plots.length) {
      for (const [first, ...others] of this.asked) {
        const plot = this.plots.add(first);
        for (const other of others) this.plots.add(other, plot);
      }
      this.asked = null;
    }
    if (!this.plots.wants(name)) return;
    const values = new Map();
    this.signals.each(name, type, sample, (full, value) => values.set(full, value), this.plots.wanted(name));
    this.plots.take(name, time, sample.epoch, values, Boolean(this.film));
  }

  // A sample that was recorded before the last one, or long after it, does not follow it.
  follows(name, log) {
    const last = this.logs.get(name);
    this.logs.set(name, log);
    if (log >= last && log <= last + GAP_S) return;
    this.plots.jump(name);
    if (name === 'state') this.places.jump();
  }

  play(at, log) {
    const {film} = this;
    if (!film) return;
    Object.assign(film, {first: log - at.position, position: at.position, duration: at.duration});
    $('playback').hidden = false;
    $('place').textContent = `${at.position.toFixed(1)} of ${at.duration.toFixed(1)} s, ${at.playing ? `${at.rate} x` : at.problem ? 'cannot be played from here' : 'paused'}`;
    $('place').title = at.problem;
    if (at.problem) this.tell(at.problem);
  }

  // --- times ------------------------------------------------------------------------------------------------------
  eventTime(event) { return this.film ? event.at - this.film.first : event.time; }
  // Of a simulated time that curves have.
  positionOf(time) {
    const {places} = this;
    if (!places.x.length) return this.film.position;
    const at = Math.min(places.place(time), places.x.length - 1);
    return places.columns.get('log')[at] - this.film.first + time - places.x[at];
  }

  // Of a recording the place, else the past; null: the present.
  go(time) {
    if (!this.film) {
      if (time === null || !(time < this.past.states.newest)) this.past.leave(); else this.past.show(time);
      return;
    }
    if (time === null || $('position').disabled) return;
    this.wanted = Math.min(Math.max(time, 0), this.film.duration);
    this.follow();
  }
  // One request at a time: while a handle is dragged, the last place counts.
  follow() {
    if (this.seeking || this.wanted === null) return;
    const position = this.wanted;
    Object.assign(this, {seeking: true, wanted: null});
    this.seek(position).catch(({message}) => this.tell(message)).finally(() => { this.seeking = false; this.follow(); });
  }
  goEvent(event) {
    if (!this.film && !(event.time >= this.past.states.first)) this.tell('The page has no memory of that time.');
    else this.go(this.eventTime(event));
  }

  // What to say of an act upon the cell, while the picture shows the past.
  warning() { return this.past.shown ? `The picture shows the past, ${this.ago()}: the cell goes on at its own time.` : ''; }
  ago() { return `history −${Math.max(this.newest.time - this.past.shown.state.time, 0).toFixed(1)} s`; }
  badge() {
    const past = Boolean(this.past.shown);
    if ($('past').hidden === past) $('past').hidden = !past;
    document.body.classList.toggle('past', past);
    if (past) { const text = this.ago(); if ($('ago').textContent !== text) $('ago').textContent = text; }
  }

  draw() {
    if (this.eventful) {
      this.events.list();
      this.timeline.setEvents(this.events.all);
      this.eventful = false;
    }
    const barred = `${this.programs.changes} ${this.newest?.epoch}`;
    if (this.barred !== barred) {
      this.barred = barred;
      this.timeline.setBars(this.programs.bars(this.newest?.epoch));
    }
    if (this.film) this.timeline.show({from: 0, to: this.film.duration, at: this.film.position, recording: true});
    else if (this.newest) this.timeline.show({from: this.past.states.first ?? this.newest.time, to: this.newest.time, at: this.past.shown?.state.time ?? null});
    this.plots.look(this.film ? this.newest?.time ?? null : this.past.shown?.state.time ?? null);
    this.badge();
    this.timeline.draw();
    this.plots.draw();
  }
  repaint() { this.plots.repaint(); this.timeline.touch(); }

  async save(plot, kind) {
    const {plots} = this, data = plots.data(plot), [from, to] = plots.shown(), color = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    const curves = plot.curves.map((curve) => ({...curve, label: labelOf(curve.name), color: plots.stroke(curve), dash: plots.dash(curve)}));
    const broken = ({name}, time) => plots.tracks.get(name.slice(0, name.indexOf('.'))).breaks.has(time);
    const file = `takt_${curves[0].name.replace(/[^\w.-]/g, '_')}.${kind}`;
    if (kind === 'csv') return download(new Blob([csvOf(curves, data, from, to)], {type: 'text/csv'}), file);
    const svg = svgOf(curves, data, from, to, {ink: color('--ink'), ground: color('--panel'), line: color('--line')}, broken);
    download(kind === 'svg' ? new Blob([svg], {type: 'image/svg+xml'}) : await pngOf(svg), file);
  }
}

const stampOf = ({header, stamp = header?.stamp}) => (stamp ? stamp.sec + (stamp.nanosec ?? stamp.nsec) / 1e9 : 0);
