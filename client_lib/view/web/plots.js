// Plots of chosen signals over simulated time: several curves each, one or two units. All have the same times and one cursor.
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import {$, make} from './dom.js';
import {Track} from './track.js';
import {levelsOf, valueText} from './signals.js';

// A colour of the page's theme, at each drawing.
const themed = (name) => () => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const COLORS = 6, DASHES = [[], [6, 4], [2, 3]], PERIOD_MS = 50, LOWEST = 150, HIGHEST = 320, MOST = 8, LEAST_SPAN_S = 1e-4;
const topicOf = (name) => name.slice(0, name.indexOf('.'));
export const labelOf = (name) => levelsOf(name).slice(1).join(' ');
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

export class Plots {
  // changed(): other curves; picked(time): a click; unitOf(name); past(name): what is kept of it, {times, values} or null;
  // save(plot, kind): the file of a plot.
  constructor(place, {changed, picked, unitOf, past, save}) {
    Object.assign(this, {place, changed, picked, unitOf, past, save, plots: [], tracks: new Map(), epoch: null, current: null, dirty: false, drawn: -Infinity, span: null, end: null, now: null, cursor: null});
    this.resized = new ResizeObserver(() => this.fit());
    this.resized.observe(place);
  }

  // Plots share the height of the panel, where it has one of its own.
  height({holder}) {
    const style = getComputedStyle(this.place), columns = style.gridTemplateColumns.split(' ').length, rows = Math.ceil(this.plots.length / columns), gap = parseFloat(style.rowGap) || 0;
    if (style.overflowY === 'visible') return LOWEST;
    return clamp(Math.floor((this.place.clientHeight - (rows - 1) * gap) / rows - holder.querySelector('.head').offsetHeight - 12), LOWEST, HIGHEST);
  }
  fit() {
    for (const plot of this.plots) {
      const width = this.width(plot.holder), height = this.height(plot);
      if (plot.chart && (plot.chart.width !== width || plot.chart.height !== height)) plot.chart.setSize({width, height});
    }
  }
  width(holder) { return Math.max(holder.querySelector('.chart').clientWidth, 200); }
  curve(name) { for (const {curves} of this.plots) for (const one of curves) if (one.name === name) return one; return null; }
  has(name) { return Boolean(this.curve(name)); }
  names() { return this.plots.map(({curves}) => (curves.length === 1 ? curves[0].name : curves.map(({name}) => name))); }
  // Topics that are needed.
  wants(topic) { return this.tracks.has(topic); }
  wanted(topic) { return [...this.tracks.get(topic)?.columns.keys() ?? []]; }
  // Numbers of a curve: {x, y}.
  numbers(name) { const track = this.tracks.get(topicOf(name)); return {x: track.x, y: track.columns.get(name)}; }

  // In this plot where its axes have the unit, or one is free; else in a plot of its own. The plot that has it then.
  add(name, plot = null) {
    if (!name || !name.includes('.')) return null;
    const before = this.plots.find(({curves}) => curves.some((one) => one.name === name));
    if (before) { this.choose(before); return before; }
    const unit = this.unitOf(name), units = plot ? this.units(plot) : [];
    if (!plot || plot.curves.length >= MOST || (!units.includes(unit) && units.length > 1)) plot = this.open();
    if (!this.tracks.has(topicOf(name))) this.tracks.set(topicOf(name), new Track());
    const track = this.tracks.get(topicOf(name)), kept = this.past(name);
    track.add(name);
    if (kept) track.fill(name, kept.times, kept.values);
    const used = plot.curves.map(({style}) => style);
    let style = this.plots.indexOf(plot) % COLORS;
    while (used.includes(style)) ++style;
    plot.curves.push({name, unit, style});
    this.build(plot);
    this.choose(plot);
    this.changed();
    return plot;
  }
  units({curves}) { return [...new Set(curves.map(({unit}) => unit))]; }
  stroke = ({style}) => themed(`--curve-${style % COLORS}`)();
  dash = ({style}) => DASHES[Math.floor(style / COLORS) % DASHES.length];

  open() {
    const holder = make('div', '', {class: 'plot', tabindex: '0', role: 'group'}), head = make('div', '', {class: 'head'}), legend = make('ul'), tools = make('span', '', {class: 'tools'});
    const plot = {holder, legend, curves: [], chart: null};
    for (const kind of ['csv', 'png', 'svg']) {
      const button = make('button', kind, {title: `save as ${kind.toUpperCase()}: the times that are shown`});
      button.onclick = () => this.save(plot, kind);
      tools.append(button);
    }
    const close = make('button', '✕', {title: 'take this plot away (Delete)', class: 'close'});
    close.onclick = () => this.close(plot);
    tools.append(close);
    head.append(tools, legend);
    holder.append(head, make('div', '', {class: 'chart'}));
    holder.addEventListener('focusin', () => this.choose(plot));
    holder.addEventListener('pointerdown', () => this.choose(plot));
    holder.addEventListener('keydown', (event) => this.key(event, plot));
    this.place.append(holder);
    this.plots.push(plot);
    return plot;
  }

  // The plot that is added to.
  choose(plot) {
    this.current = plot;
    for (const {holder} of this.plots) holder.classList.toggle('current', holder === plot?.holder && this.plots.length > 1);
  }

  close(plot) {
    const i = this.plots.indexOf(plot), focused = plot.holder.contains(document.activeElement);
    for (const {name} of [...plot.curves]) this.forget(name);
    plot.chart?.destroy();
    plot.holder.remove();
    this.plots.splice(i, 1);
    this.choose(this.plots[Math.min(i, this.plots.length - 1)] ?? null);
    this.fit();
    if (focused) (this.current?.holder ?? $('signal')).focus();
    this.changed();
  }
  forget(name) {
    const track = this.tracks.get(topicOf(name));
    track.drop(name);
    if (!track.columns.size) this.tracks.delete(topicOf(name));
  }
  remove(plot, curve) {
    if (plot.curves.length === 1) return this.close(plot);
    plot.curves.splice(plot.curves.indexOf(curve), 1);
    this.forget(curve.name);
    this.build(plot);
    plot.holder.focus();
    this.changed();
  }

  build(plot) {
    const {curves, holder, legend} = plot, units = this.units(plot);
    legend.replaceChildren(...curves.map((curve) => {
      const item = make('li', '', {title: curve.name}), swatch = make('i'), button = make('button', '✕', {'aria-label': `take ${curve.name} away`, title: 'take this curve away'});
      curve.newest = make('output');
      curve.swatch = swatch;
      button.onclick = () => this.remove(plot, curve);
      item.append(swatch, make('span', labelOf(curve.name)), curve.newest);
      if (curves.length > 1) item.append(button);
      return item;
    }));
    holder.setAttribute('aria-label', `plot of ${curves.map(({name}) => labelOf(name)).join(', ')}`);
    plot.chart?.destroy();
    const axis = {stroke: themed('--ink'), grid: {stroke: themed('--line'), width: 1}, ticks: {stroke: themed('--line'), width: 1}, font: '11px system-ui, sans-serif', labelFont: '11px system-ui, sans-serif'};
    const side = (i) => ({...axis, scale: `y${i}`, side: i ? 1 : 3, size: 52, label: units[i] || undefined, labelSize: 14, grid: {...axis.grid, show: i === 0}, values: (chart, values) => values.map((value) => String(Number(value.toPrecision(6))))});
    plot.chart = new uPlot({
      width: this.width(holder), height: this.height(plot), legend: {show: false},
      scales: {x: {time: false}, ...Object.fromEntries(units.map((unit, i) => [`y${i}`, {}]))},
      axes: [{...axis, size: 24}, ...units.map((unit, i) => side(i))],
      series: [{label: 's'}, ...curves.map((curve) => ({
        label: curve.name, scale: `y${units.indexOf(curve.unit)}`, stroke: () => this.stroke(curve), width: 1.75, dash: this.dash(curve), points: {show: ({data: [times]}) => times.length === 1, size: 5, fill: () => this.stroke(curve)}, gaps: (chart, i, from, to, gaps) => this.gaps(chart, curve, gaps)}))],
      cursor: {sync: {key: 'takt', setSeries: false, scales: ['x', null]}, drag: {x: true, y: false, setScale: false, dist: 5}, points: {size: 7}, y: false, bind: {dblclick: () => () => { this.zoom(null); return null; }}},
      hooks: {
        setSelect: [(chart) => {
          if (chart.select.width < 5) return;
          const from = chart.posToVal(chart.select.left, 'x'), to = chart.posToVal(chart.select.left + chart.select.width, 'x');
          chart.setSelect({left: 0, top: 0, width: 0, height: 0}, false);
          this.zoom(to - from, to);
        }],
        setCursor: [(chart) => {
          const {left} = chart.cursor, time = left >= 0 && left !== undefined && left !== null ? chart.posToVal(left, 'x') : null;
          if (time === this.cursor) return;
          this.cursor = time;
          this.say();
        }],
        draw: [(chart) => this.line(chart)],
      },
    }, this.data(plot), holder.querySelector('.chart'));
    const {over} = plot.chart;
    over.addEventListener('wheel', (event) => {
      event.preventDefault();
      const box = over.getBoundingClientRect();
      this.scale(event.deltaY < 0 ? 0.8 : 1.25, clamp((event.clientX - box.left) / box.width, 0, 1));
    }, {passive: false});
    let from = null, waiting = null;
    over.addEventListener('pointerdown', (event) => { from = event.button === 0 ? [event.clientX, event.clientY] : null; });
    over.addEventListener('click', (event) => {
      clearTimeout(waiting);
      if (!from || event.detail > 1 || Math.hypot(event.clientX - from[0], event.clientY - from[1]) > 4) return;
      const time = plot.chart.posToVal(event.clientX - over.getBoundingClientRect().left, 'x');
      waiting = setTimeout(() => this.picked(time), 250);  // a second click makes it a double one
    });
    this.paintLegend(plot);
    this.fit();
    this.touch();
  }

  // Where a recording was not played, the line is not drawn.
  gaps(chart, {name}, gaps) {
    const {breaks, x} = this.tracks.get(topicOf(name)) ?? {breaks: [], x: []};
    for (const time of breaks) {
      const at = this.tracks.get(topicOf(name)).place(time);
      if (at > 0) gaps.push([chart.valToPos(x[at - 1], 'x', true), chart.valToPos(time, 'x', true)]);
    }
    return gaps.sort((a, b) => a[0] - b[0]);
  }

  data({curves}) {
    const topics = [...new Set(curves.map(({name}) => topicOf(name)))];
    const tables = topics.map((topic) => {
      const own = curves.filter(({name}) => topicOf(name) === topic), track = this.tracks.get(topic);
      return {own, table: [track.x, ...own.map(({name}) => track.columns.get(name))]};
    });
    if (tables.length === 1) return tables[0].table;
    const [x, ...columns] = uPlot.join(tables.map(({table}) => table)), order = tables.flatMap(({own}) => own);
    return [x, ...curves.map((curve) => columns[order.indexOf(curve)])];
  }

  // --- times that are shown ---------------------------------------------------------------------------------------
  range() {
    let first = Infinity, last = -Infinity;
    for (const {x} of this.tracks.values()) if (x.length) { first = Math.min(first, x[0]); last = Math.max(last, x.at(-1)); }
    return first <= last ? [first, last] : [0, 1];
  }
  shown() {
    const [first, last] = this.range();
    // Joint states have their time in whole nanoseconds: one instant of two topics may be two numbers, between which no axis has ticks.
    if (this.span === null) return [first, last - first >= LEAST_SPAN_S ? last : first + 1];
    const end = this.end ?? last;
    return [end - this.span, end];
  }
  // Seconds up to an end, else up to the newest sample; null: all.
  zoom(span, end = null) {
    const [first, last] = this.range();
    this.span = span === null || (span >= last - first && span > 0) ? null : Math.max(span, LEAST_SPAN_S);
    this.end = this.span === null || end === null || end >= last ? null : Math.max(end, first + this.span);
    this.touch();
  }
  // `at`: the part of the width that stays.
  scale(factor, at) {
    const [from, to] = this.shown(), span = (to - from) * factor, fixed = from + at * (to - from);
    this.zoom(span, at > 0.98 && this.end === null ? null : fixed + (1 - at) * span);
  }
  pan(part) {
    const [from, to] = this.shown();
    if (this.span !== null) this.zoom(to - from, to + part * (to - from));
  }

  key(event, plot) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target !== plot.holder) return;
    const actions = {'+': () => this.scale(0.8, 0.5), '-': () => this.scale(1.25, 0.5), 0: () => this.zoom(null), ArrowLeft: () => this.pan(-0.1), ArrowRight: () => this.pan(0.1), Delete: () => this.close(plot)};
    const action = actions[event.key === '=' ? '+' : event.key];
    if (!action) return;
    event.preventDefault();
    event.stopPropagation();
    action();
  }

  // --- samples ----------------------------------------------------------------------------------------------------
  // The numbers of a sample of this topic. `epoch` is not known of all topics: joint states have the form that ROS 2 gave them.
  // Their time goes back with that of the cell.
  take(topic, time, epoch, values, recording) {
    if (epoch !== undefined) {
      if (epoch !== this.epoch) this.clear();  // the cell was reset: time is zero again
      this.epoch = epoch;
    }
    const track = this.tracks.get(topic);
    if (!track) return;
    if (!recording && time < track.x.at(-1)) track.clear();
    if (track.x.length || [...values.values()].some((value) => value !== null)) if (track.take(time, values)) this.touch();
  }
  // The next sample of this topic does not follow the last one.
  jump(topic) { this.tracks.get(topic)?.jump(); }
  clear() { for (const track of this.tracks.values()) track.clear(); this.zoom(null); }
  touch() { this.dirty = true; }

  // --- drawing ----------------------------------------------------------------------------------------------------
  draw(now = performance.now()) {
    if (!this.dirty || now - this.drawn < PERIOD_MS || !this.place.offsetParent) return;
    this.drawn = now;
    this.dirty = false;
    const [min, max] = this.shown();
    for (const plot of this.plots)
      plot.chart.batch(() => {
        plot.chart.setData(this.data(plot), false);
        plot.chart.setScale('x', {min, max});
        for (let i = 0; i < this.units(plot).length; ++i) plot.chart.setScale(`y${i}`, {min: null, max: null});
      });
    this.say();
  }
  // Values at the cursor, else at the time that is looked at, else the newest ones.
  say() {
    const time = this.cursor ?? this.now;
    for (const {curves} of this.plots)
      for (const {name, unit, newest} of curves) {
        const track = this.tracks.get(topicOf(name)), value = time === null ? track.columns.get(name).at(-1) : track.at(name, time);
        const text = value === undefined ? '' : valueText(value, unit);
        if (newest.textContent !== text) newest.textContent = text;
      }
  }
  // The time that the picture shows, where that is not the newest: null.
  look(time) {
    if (time === this.now) return;
    this.now = time;
    this.touch();
  }
  line(chart) {
    if (this.now === null) return;
    const x = chart.valToPos(this.now, 'x', true), {left, top, width, height} = chart.bbox, {ctx} = chart;
    if (x < left || x > left + width) return;
    ctx.save();
    ctx.strokeStyle = themed('--accent')();
    ctx.lineWidth = 2 * devicePixelRatio;
    ctx.beginPath();
    ctx.moveTo(x, top);
    ctx.lineTo(x, top + height);
    ctx.stroke();
    ctx.restore();
  }

  // The theme of the page has changed.
  paintLegend({curves}) { for (const curve of curves) curve.swatch.style.background = this.dash(curve).length ? `repeating-linear-gradient(90deg,${this.stroke(curve)} 0 4px,transparent 4px 6px)` : this.stroke(curve); }
  repaint() { for (const plot of this.plots) { plot.chart.redraw(false); this.paintLegend(plot); } }
}
