// The samples of one topic that curves need: times in rising order, and a column of numbers for each curve. Of a number a
// sample may have none (null: the curve has a gap there); undefined: the number at that time is not known.
export class Track {
  constructor(most = 20000) { Object.assign(this, {most, x: [], columns: new Map()}); this.clear(); }

  clear() {
    this.x.length = 0;
    for (const column of this.columns.values()) column.length = 0;
    this.breaks = new Set();  // times whose sample does not follow the one before: a recording was played from there
    this.end = null;          // the newest sample of what plays
  }

  add(name) { if (!this.columns.has(name)) this.columns.set(name, new Array(this.x.length).fill(undefined)); }
  drop(name) { this.columns.delete(name); }

  // The next sample does not follow those before.
  jump() { this.end = null; }

  // The first place whose time is not below this one.
  place(time) {
    let low = 0, high = this.x.length;
    if (!high || this.x[high - 1] < time) return high;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.x[middle] < time) low = middle + 1; else high = middle;
    }
    return low;
  }

  // True: it changes something.
  take(time, values) {
    const {x, breaks} = this, at = this.place(time), same = x[at] === time, next = x[at];
    let changed = !same;
    if (same) {
      for (const [name, column] of this.columns) {
        const value = values.get(name) ?? null;
        changed ||= column[at] !== value;
        column[at] = value;
      }
    } else {
      x.splice(at, 0, time);
      for (const [name, column] of this.columns) column.splice(at, 0, values.get(name) ?? null);
      const follows = this.end !== null && this.end <= time, amid = at > 0 && next !== undefined && !breaks.has(next);
      if (at === 0 && next !== undefined) breaks.add(next);
      if (at > 0 && !amid && !follows) breaks.add(time);
    }
    if (this.end !== null && this.end <= time) for (const one of breaks) if (one > this.end && one <= time) breaks.delete(one);
    this.end = time;
    if (x.length > this.most) {
      const many = Math.ceil(this.most / 4);
      x.splice(0, many);
      for (const column of this.columns.values()) column.splice(0, many);
      for (const one of breaks) if (one <= x[0]) breaks.delete(one);
    }
    return changed;
  }

  // Numbers of one column that another memory has of earlier times.
  fill(name, times, values) {
    this.add(name);
    const column = this.columns.get(name);
    times.forEach((time, i) => {
      const at = this.place(time);
      if (this.x[at] !== time) {
        this.x.splice(at, 0, time);
        for (const other of this.columns.values()) other.splice(at, 0, undefined);
      }
      column[at] ??= values[i];
    });
    this.end ??= this.x.at(-1) ?? null;
  }

  // The number at a time: that of the newest sample then. undefined: none is as old.
  at(name, time) {
    const column = this.columns.get(name);
    let at = this.place(time);
    if (this.x[at] !== time) --at;
    while (at >= 0 && column?.[at] === undefined) --at;
    return column?.[at];
  }
}
