// The timeline: events as marks, steps of the robots' programs as bars, the time that is shown as a handle. Of a recording all
// of it, in seconds from its beginning; of a running cell the minutes that the page keeps, in simulated time; or a part of that.
import {$, make} from './dom.js';
import {Severity, nameOf} from './messages.js';
import {gathered, saying} from './events.js';
import {TimeWindow} from './time_window.js';

const NEAR_PX = 6, PERIOD_MS = 100, EDGE_PX = 6, LEAST_S = 1, MOST_LINES = 6, DRAG_PX = 4;
const STEP = 0.7;  // of the width, by a key, a button or a notch of the wheel
const LANE_PX = 38, ROW_PX = 13, MOST_ROWS = 4;  // the rows of the bars lie below the handle's lane
const COLORS = {[Severity.information]: '--soft', [Severity.warning]: '--warn', [Severity.error]: '--bad'};

export class Timeline {
  // go(time): shows this time; null: the present. eventTime(event): its time here. stepTime(time): that of a simulated time.
  constructor({go, eventTime, stepTime}) {
    Object.assign(this, {go, eventTime, stepTime, bars: [], drawnBars: [], window: new TimeWindow(), newest: 0, at: null, jumped: null, pending: null, marks: [], events: [], drawn: -Infinity, dirty: true, recording: false});
    const slider = $('position');
    this.canvas = $('timeline').querySelector('canvas');
    slider.oninput = () => this.slid(Number(slider.value));
    slider.addEventListener('pointermove', (event) => this.hover(event));
    slider.addEventListener('pointerleave', () => { $('marks').hidden = true; });
    slider.addEventListener('click', (event) => {
      const mark = this.under(event);
      if (mark && !slider.disabled) this.jump(this.eventTime(mark.groups[0].newest));
    });
    slider.addEventListener('keydown', (event) => {
      const step = {PageUp: 1, PageDown: -1}[event.key];
      if (!step || slider.disabled) return;
      event.preventDefault();
      const now = this.jumped?.at === this.at ? this.jumped.time : this.at ?? this.newest, all = event.shiftKey ? this.bars.flatMap(({steps}) => steps.map(({begin}) => this.stepTime(begin))) : this.events.map((one) => this.eventTime(one));
      const times = all.filter((time) => (step > 0 ? time > now + 1e-6 : time < now - 1e-6));
      if (times.length) this.jump(step > 0 ? Math.min(...times) : Math.max(...times));
      else if (step > 0) this.jump(null);
    });
    const {canvas} = this;
    canvas.addEventListener('pointermove', (event) => this.hoverBar(event));
    canvas.addEventListener('pointerleave', () => { $('marks').hidden = true; });
    canvas.addEventListener('click', (event) => { const bar = this.barUnder(event); if (bar && !slider.disabled && !this.dragged) this.jump(this.stepTime(bar.step.begin)); });
    this.pan();
    $('nearer').onclick = () => this.zoom(1);
    $('farther').onclick = () => this.zoom(-1);
    $('all-times').onclick = () => this.fit();
    new ResizeObserver(() => this.touch()).observe($('timeline'));
  }

  touch() { this.dirty = true; }

  // --- the part of the times that is seen -------------------------------------------------------------------------
  get from() { return this.window.from; }
  get to() { return this.window.to; }
  // `at`: the time that stays in its place; without one that of the handle where it is seen, else the middle.
  scale(factor, at = this.seen(this.at ?? this.newest) ? this.at ?? this.newest : (this.from + this.to) / 2) { if (this.window.scale(factor, at)) this.touch(); }
  zoom(nearer) { this.scale(STEP ** nearer); }
  move(part) { if (this.window.move(part * (this.to - this.from))) this.touch(); }
  fit() { if (this.window.fit()) this.touch(); }
  seen(time) { return time >= this.from && time <= this.to; }
  timeAt(x) { return this.from + (x - EDGE_PX) / Math.max(this.width - 2 * EDGE_PX, 1) * (this.to - this.from); }

  // The wheel zooms about the pointer, sideways or with Shift it moves. A drag beside the handle's lane moves, within it with Shift.
  pan() {
    const place = $('timeline'), slider = $('position'), x = (event) => event.clientX - place.getBoundingClientRect().left;
    place.addEventListener('wheel', (event) => {
      event.preventDefault();
      const along = event.deltaX || (event.shiftKey ? event.deltaY : 0);
      if (along) this.move(Math.sign(along) * 0.1); else if (event.deltaY) this.scale(event.deltaY < 0 ? STEP : 1 / STEP, this.timeAt(x(event)));
    }, {passive: false});
    place.addEventListener('dblclick', (event) => { if (event.target !== slider) this.fit(); });
    slider.addEventListener('mousedown', (event) => { if (event.shiftKey) event.preventDefault(); });
    let held = null;
    place.addEventListener('pointerdown', (event) => {
      this.dragged = false;
      if (event.button === 0 && (event.target !== slider || event.shiftKey)) held = {x: x(event), from: this.from, to: this.to, pointer: event.pointerId};
    });
    place.addEventListener('pointermove', (event) => {
      if (!held || (!this.dragged && Math.abs(x(event) - held.x) < DRAG_PX)) return;
      if (!this.dragged) { this.dragged = true; place.setPointerCapture(held.pointer); place.classList.add('held'); }
      const share = (held.x - x(event)) / Math.max(this.width - 2 * EDGE_PX, 1);
      if (this.window.move(held.from + share * (held.to - held.from) - this.from)) this.touch();
    });
    for (const end of ['pointerup', 'pointercancel']) place.addEventListener(end, () => { held = null; place.classList.remove('held'); });
  }

  // `at`: the time that is shown; null: the newest of a cell. A recording has its whole length from the start.
  show({from, to, at, recording = false}) {
    const newest = to;
    from = Math.max(Math.min(from, newest - LEAST_S), 0);
    to = Math.max(to, from + LEAST_S);
    const before = this.at, asked = at !== null && at !== before ? this.pending : null;
    if (at !== before) Object.assign(this, {jumped: asked === null ? null : {time: asked, at}, pending: null});
    if (this.recording !== recording) this.window.fit();
    const changed = this.window.within(from, to);
    if (!changed && newest === this.newest && at === before && recording === this.recording) return;
    const watched = before === null || this.seen(before);
    Object.assign(this, {newest, at, recording, dirty: true});
    // A cell that goes on moves what is seen, but not away from a time that is looked at. What is jumped to is seen, as is what
    // plays.
    if (at === null) { if (before !== null) this.window.follow(); } else {
      this.window.hold();
      if (at !== before && (asked !== null || watched)) this.window.reach(asked ?? at);
    }
  }
  setEvents(events) { this.events = events; this.dirty = true; }
  // [{robot, steps}]
  setBars(bars) {
    Object.assign(this, {bars, dirty: true});
    $('timeline').style.height = bars.length ? `${LANE_PX + ROW_PX * Math.min(bars.length, MOST_ROWS)}px` : '';
  }

  // What is shown is the newest instant at a time, which may lie ahead of it: the next key goes on from the time itself.
  jump(time) {
    Object.assign(this, {jumped: time === null ? null : {time, at: this.at}, pending: time});
    this.go(time);
  }

  slid(part) {
    const time = this.from + part * (this.to - this.from);
    this.jump(!this.recording && (time >= this.newest || (part > 0.999 && this.window.whole)) ? null : time);
  }

  // Both ends of the slider's way are half a handle inside.
  place(time) { return EDGE_PX + (time - this.from) / Math.max(this.to - this.from, 1e-9) * (this.width - 2 * EDGE_PX); }

  draw(now = performance.now()) {
    if (!this.dirty || now - this.drawn < PERIOD_MS || !this.canvas.offsetParent) return;
    Object.assign(this, {drawn: now, dirty: false});
    const {canvas, from, to} = this, {clientWidth: width, clientHeight: whole} = canvas, height = Math.min(whole, LANE_PX), sharp = devicePixelRatio;
    this.width = width;
    if (canvas.width !== Math.round(width * sharp) || canvas.height !== Math.round(whole * sharp)) Object.assign(canvas, {width: Math.round(width * sharp), height: Math.round(whole * sharp)});
    const context = canvas.getContext('2d'), style = getComputedStyle(document.documentElement), color = (name) => style.getPropertyValue(name).trim();
    context.setTransform(sharp, 0, 0, sharp, 0, 0);
    context.clearRect(0, 0, width, whole);
    context.fillStyle = color('--raised');
    context.fillRect(EDGE_PX, 14, width - 2 * EDGE_PX, height - 16);
    this.drawPart(context, color);
    context.font = '11px system-ui, sans-serif';
    context.textBaseline = 'top';
    const rough = (to - from) / Math.max(Math.floor(width / 90), 1), power = 10 ** Math.floor(Math.log10(rough)), step = [1, 2, 5, 10].map((one) => one * power).find((one) => one >= rough);
    for (let n = Math.ceil(from / step - 1e-9); n * step <= to + 1e-9; ++n) {
      const x = this.place(n * step), text = `${Number((n * step).toPrecision(10))} s`, half = context.measureText(text).width / 2;
      context.fillStyle = color('--line');
      context.fillRect(Math.round(x), 14, 1, height - 16);
      context.fillStyle = color('--soft');
      context.fillText(text, Math.min(Math.max(x - half, 0), width - 2 * half), 0);
    }
    this.layMarks();
    const middle = 14 + (height - 16) / 2;
    for (const {x, severity} of this.marks) {
      context.fillStyle = color(COLORS[severity] ?? '--soft');
      context.beginPath();
      if (severity === Severity.error) context.rect(x - 4, middle - 4, 8, 8);
      else if (severity === Severity.warning) { context.moveTo(x, middle - 6); context.lineTo(x + 5, middle + 4); context.lineTo(x - 5, middle + 4); }
      else context.arc(x, middle, 3, 0, 2 * Math.PI);
      context.fill();
    }
    this.drawBars(context, color, whole);
    const slider = $('position'), value = ((this.at ?? this.newest) - from) / Math.max(to - from, 1e-9);
    if (!slider.matches(':active')) slider.value = value;
    slider.classList.toggle('outside', value < 0 || value > 1 + 1e-9);
    const {partial} = this.window;
    $('timeline').classList.toggle('partial', partial);
    for (const id of ['farther', 'all-times']) if ($(id).disabled === partial) $(id).disabled = !partial;
    $('nearer').disabled = !this.window.divisible;
    slider.setAttribute('aria-valuetext', this.at === null ? 'live' : `${this.at.toFixed(2)} s`);
  }

  // Which part of all times is seen: a bar below the numbers.
  drawPart(context, color) {
    const {first, last, partial} = this.window, wide = this.width - 2 * EDGE_PX, length = Math.max(last - first, 1e-9);
    if (!partial) return;
    context.fillStyle = color('--accent');
    const a = wide * (this.from - first) / length, b = wide * (this.to - first) / length;
    context.fillRect(EDGE_PX + Math.min(a, wide - 3), 14, Math.max(b - a, 3), 2);
  }

  // A row for each robot. A step that goes on ends at the newest time.
  drawBars(context, color, whole) {
    this.drawnBars = [];
    const {bars, width} = this, row = (whole - LANE_PX) / Math.max(bars.length, 1);
    if (!bars.length || row < 1) return;
    context.font = '10px system-ui, sans-serif';
    context.textBaseline = 'middle';
    bars.forEach(({robot, steps}, i) => {
      const top = LANE_PX + i * row, tall = Math.max(row - 2, 1);
      steps.forEach((step, n) => {
        const begin = this.stepTime(step.begin), end = step.end < 0 ? this.newest : this.stepTime(step.end);
        if (end < this.from || begin > this.to) return;
        const a = this.place(Math.max(begin, this.from)), b = Math.max(this.place(Math.min(end, this.to)), a + 1);
        context.globalAlpha = step.end < 0 ? 0.5 : n % 2 ? 0.34 : 0.2;
        context.fillStyle = color('--accent');
        context.fillRect(a, top, Math.max(b - a - 1, 1), tall);
        context.globalAlpha = 1;
        this.drawnBars.push({a, b, top, bottom: top + row, robot, step});
        const text = step.name;
        if (row >= 10 && context.measureText(text).width < b - a - 8) {
          context.fillStyle = color('--ink');
          context.fillText(text, a + 4, top + tall / 2 + 0.5);
        }
      });
    });
    context.fillStyle = color('--accent');
    if (this.seen(this.at ?? this.newest)) context.fillRect(Math.round(this.place(this.at ?? this.newest)), LANE_PX, 1, whole - LANE_PX);
    context.textBaseline = 'top';
  }
  barUnder({offsetX: x, offsetY: y}) { return this.drawnBars.findLast(({a, b, top, bottom}) => x >= a && x <= b && y >= top && y < bottom) ?? null; }
  hoverBar(event) {
    const bar = this.barUnder(event), box = $('marks');
    box.hidden = !bar;
    if (!bar) return;
    const {robot, step: {name, begin, end, line}} = bar;
    box.replaceChildren(make('div', `${robot}: ${name}`), make('div', `${begin.toFixed(3)} s to ${end < 0 ? 'now' : `${end.toFixed(3)} s, ${Number((end - begin).toPrecision(3))} s`}${line ? `; line ${line} of the program` : ''}`));
    box.style.left = `${Math.min(bar.a, Math.max(this.width - box.offsetWidth, 0))}px`;
  }

  // Events that would lie upon each other are one mark, of the worst among them.
  layMarks() {
    this.marks = [];
    const shown = this.events.map((event) => ({event, time: this.eventTime(event)})).filter(({time}) => time >= this.from && time <= this.to).sort((a, b) => a.time - b.time);
    for (const {event, time} of shown) {
      const x = this.place(time), last = this.marks.at(-1);
      if (last && x - last.x < NEAR_PX) last.events.push(event);
      else this.marks.push({x, events: [event]});
    }
    for (const mark of this.marks) {
      mark.groups = gathered(mark.events).sort((a, b) => b.newest.severity - a.newest.severity);
      mark.severity = mark.groups[0].newest.severity;
    }
    this.marks.sort((a, b) => a.severity - b.severity);  // the worst is drawn last
  }

  under({offsetX: x}) {
    const near = this.marks.filter((mark) => Math.abs(mark.x - x) <= NEAR_PX);
    return near.sort((a, b) => Math.abs(a.x - x) - Math.abs(b.x - x))[0] ?? null;
  }
  hover(event) {
    const mark = this.under(event), box = $('marks');
    box.hidden = !mark;
    if (!mark) return;
    const lines = mark.groups.slice(0, MOST_LINES).map((group) => {
      const line = document.createElement('div');
      line.className = nameOf(Severity, group.newest.severity);
      line.textContent = `${group.newest.time.toFixed(3)} s  ${saying(group)}`;
      return line;
    });
    if (mark.groups.length > MOST_LINES) lines.push(document.createTextNode(`and ${mark.groups.length - MOST_LINES} others`));
    box.replaceChildren(...lines);
    box.style.left = `${Math.min(mark.x, Math.max(this.width - box.offsetWidth, 0))}px`;
  }
}
