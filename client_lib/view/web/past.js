// The last minutes of a running cell, in bounded memory: samples as arrays of numbers, beside the form that many of them share.
// While a time of the past is looked at, the cell goes on and is recorded on.
const PERIOD_MS = 50, SLOWEST_MS = 200, MINUTES_MS = 300000, MOST_BYTES = 64e6;
// Of a form, for each of its numbers; and the forms that are tried before another one is made.
const FORM_BYTES = 64, MOST_FORMS = 16;

// A form is the sample without its numbers. pack() writes them; false: the sample has another form.
const formOf = (value) => {
  if (typeof value === 'bigint') return 'whole';
  if (typeof value === 'number' || typeof value === 'boolean') return typeof value;
  if (ArrayBuffer.isView(value)) return {numbers: value.length, kind: value.constructor};
  if (Array.isArray(value)) return {list: value.map(formOf)};
  if (value && typeof value === 'object') return {fields: Object.entries(value).map(([key, of]) => [key, formOf(of)])};
  return {same: value};
};
const kindsOf = (form, kinds = []) => {
  if (typeof form === 'string') kinds.push(form);
  else if (form.kind) for (let i = 0; i < form.numbers; ++i) kinds.push('number');
  else if (form.list) for (const one of form.list) kindsOf(one, kinds);
  else if (form.fields) for (const [, one] of form.fields) kindsOf(one, kinds);
  return kinds;
};

class Pen {
  over(words) { Object.assign(this, {words, whole: new BigUint64Array(words.buffer), at: 0}); return this; }

  pack(form, value) {
    if (form === 'number') { if (typeof value !== 'number') return false; this.words[this.at++] = value; return true; }
    if (form === 'boolean') { if (typeof value !== 'boolean') return false; this.words[this.at++] = value ? 1 : 0; return true; }
    if (form === 'whole') { if (typeof value !== 'bigint') return false; this.whole[this.at++] = value; return true; }
    if (form.kind) {
      if (value?.length !== form.numbers || value.constructor !== form.kind) return false;
      for (let i = 0; i < form.numbers; ++i) this.words[this.at++] = Number(value[i]);
      return true;
    }
    if (form.list) return Array.isArray(value) && value.length === form.list.length && form.list.every((one, i) => this.pack(one, value[i]));
    if (form.fields) return form.fields.every(([key, one]) => this.pack(one, value?.[key]));
    return value === form.same;
  }

  // `raw`: truth values as they are kept.
  unpack(form, raw = false) {
    if (form === 'number') return this.words[this.at++];
    if (form === 'boolean') return raw ? this.words[this.at++] : this.words[this.at++] === 1;
    if (form === 'whole') return this.whole[this.at++];
    if (form.kind) {
      const big = form.kind === BigInt64Array || form.kind === BigUint64Array;
      return form.kind.from({length: form.numbers}, () => (big ? BigInt(this.words[this.at++]) : this.words[this.at++]));
    }
    if (form.list) return form.list.map((one) => this.unpack(one, raw));
    if (form.fields) return Object.fromEntries(form.fields.map(([key, one]) => [key, this.unpack(one, raw)]));
    return form.same;
  }
}

// Samples of one topic.
export class Reel {
  constructor(bytes = MOST_BYTES) { Object.assign(this, {most: bytes, pen: new Pen()}); this.clear(); }
  clear() { Object.assign(this, {frames: [], bytes: 0, forms: [], last: -Infinity}); }

  get first() { return this.frames[0]?.time; }
  get newest() { return this.frames.at(-1)?.time; }
  // Room for five minutes: of a large cell fewer instants are kept, and of a very large one the last of them.
  get period() { return Math.min(Math.max(PERIOD_MS, MINUTES_MS * 8 * (this.forms[0]?.count ?? 0) / this.most), SLOWEST_MS); }

  // `now`: wall time, ms. True: the sample is kept. `always`: however short ago the last one is.
  take(time, sample, now, always = false) {
    if (time < this.newest) return false;
    const again = time === this.newest;  // a standing cell may have changed
    if (!always && !again && now - this.last < this.period) return false;
    if (again) this.bytes -= this.frames.pop().bytes;
    let words, form = this.forms.find((one) => this.pen.over(words = new Float64Array(one.count)).pack(one.form, sample)), bytes = 0;
    if (!form) {
      form = {form: formOf(sample)};
      form.kinds = kindsOf(form.form);
      form.count = form.kinds.length;
      this.pen.over(words = new Float64Array(form.count)).pack(form.form, sample);
      bytes = FORM_BYTES * form.count;
    }
    if (this.forms[0] !== form) this.forms = [form, ...this.forms.filter((one) => one !== form)].slice(0, MOST_FORMS);
    bytes += words.byteLength;
    if (!again) this.last = now;
    this.frames.push({time, words, form, bytes});
    this.bytes += bytes;
    while (this.frames.length > 1 && (this.bytes > this.most || this.frames.length > MINUTES_MS / PERIOD_MS)) this.bytes -= this.frames.shift().bytes;
    return true;
  }

  // The sample at this time or the last one before it, else the first.
  frame(time) {
    let low = 0, high = this.frames.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.frames[middle].time <= time) low = middle + 1; else high = middle;
    }
    return this.frames[Math.max(low - 1, 0)];
  }
  at(time) {
    const frame = this.frame(time);
    return frame && this.pen.over(frame.words).unpack(frame.form.form);
  }

  // One number of all samples: {times, values}. placeOf(sample) finds it in a sample whose numbers are their places; undefined:
  // a sample of that form has no such number.
  column(placeOf) {
    const places = new Map(), times = [], values = [];
    for (const {time, words, form} of this.frames) {
      if (!places.has(form)) {
        const numbered = Float64Array.from({length: form.count}, (one, i) => i), whole = new BigUint64Array(numbered.buffer);
        form.kinds.forEach((kind, i) => { if (kind === 'whole') whole[i] = BigInt(i); });
        places.set(form, placeOf(this.pen.over(numbered).unpack(form.form, true)));
      }
      const place = places.get(form);
      times.push(time);
      values.push(place === undefined ? null : form.kinds[place] === 'whole' ? Number(new BigUint64Array(words.buffer)[place]) : words[place]);
    }
    return {times, values};
  }
}

export class Past {
  // changed(): another time is looked at, or the present again.
  constructor(changed) {
    Object.assign(this, {changed, states: new Reel(), contacts: new Reel(MOST_BYTES / 4), run: '', shown: null});
  }

  clear() {
    this.states.clear();
    this.contacts.clear();
    this.leave();
  }

  // Contacts of an instant are kept where its state is, whichever comes first.
  take(state, contacts, now) {
    const run = `${state.scenario_generation} ${state.epoch}`;
    if (run !== this.run) this.clear();  // time is zero again
    this.run = run;
    if (this.states.take(state.time, state, now) && contacts?.time === state.time) this.contacts.take(state.time, contacts, now, true);
  }
  takeContacts(contacts, now) { if (contacts.time === this.states.newest) this.contacts.take(contacts.time, contacts, now, true); }

  show(time) {
    const state = this.states.at(time);
    if (!state) return;
    const contacts = this.contacts.at(state.time);
    this.shown = {state, contacts: contacts?.time === state.time ? contacts.contacts : []};
    this.changed();
  }
  leave() {
    if (!this.shown) return;
    this.shown = null;
    this.changed();
  }
}
