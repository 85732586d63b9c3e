// The part of a range of times that is seen: all of it, a part that keeps its place, or a part that goes on with the newest time.
const LEAST_S = 0.02;

export class TimeWindow {
  constructor() { Object.assign(this, {first: 0, last: 1, span: null, end: null}); }

  get to() { return this.span === null ? this.last : this.end ?? this.last; }
  get from() { return this.span === null ? this.first : this.to - this.span; }
  get partial() { return this.span !== null; }
  // It has the newest time at its end.
  get whole() { return this.end === null || this.span === null; }
  get divisible() { return this.to - this.from > LEAST_S * 1.0001; }

  // All times. True: others are seen than before.
  within(first, last) {
    const {from, to} = this;
    Object.assign(this, {first, last});
    this.clip();
    return from !== this.from || to !== this.to;
  }
  clip() {
    const {first, last} = this;
    if (this.span === null) return;
    if (this.span >= last - first) Object.assign(this, {span: null, end: null});
    else if (this.end !== null) this.end = Math.min(Math.max(this.end, first + this.span), last);
  }

  set(from, to) {
    const before = [this.from, this.to];
    Object.assign(this, {span: Math.max(to - from, LEAST_S), end: to >= this.last ? null : to});
    this.clip();
    return before[0] !== this.from || before[1] !== this.to;
  }
  // `at` keeps its place.
  scale(factor, at) {
    const {from, to} = this, wide = to - from, span = Math.max(wide * factor, LEAST_S), share = (at - from) / wide;
    return this.set(at - share * span, at + (1 - share) * span);
  }
  move(by) {
    const {first, last, from, to} = this, way = Math.min(Math.max(by, first - from), last - to);
    return this.partial && way !== 0 && this.set(from + way, to + way);
  }
  fit() {
    const changed = this.partial;
    Object.assign(this, {span: null, end: null});
    return changed;
  }
  hold() { if (this.partial) this.end ??= this.last; }
  follow() { this.end = null; }
  // A time that is not seen comes to a tenth of the width.
  reach(time) {
    const {from, to} = this, wide = to - from;
    if (this.partial && (time < from || time > to)) { this.end = time + 0.9 * wide; this.clip(); }
  }
}
