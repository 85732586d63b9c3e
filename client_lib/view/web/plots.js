// Live plots of chosen signals over simulated time.
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';

// A colour of the page's theme, at each drawing.
const themed = (name) => () => getComputedStyle(document.documentElement).getPropertyValue(name);
const AXIS = {stroke: themed('--ink'), grid: {stroke: themed('--line')}, ticks: {stroke: themed('--line')}};
const MOST = 4000, COLORS = ['#1f6fb4', '#d1495b', '#2e9e5b', '#8a5cc2', '#c77d0a', '#4b5563'];

export class Plots {
  constructor(place, changed) { Object.assign(this, {place, changed, plots: [], epoch: null}); }

  has(name) { return this.plots.some((plot) => plot.name === name); }

  add(name) {
    if (!name || this.has(name)) return;
    const holder = document.createElement('div');
    holder.className = 'plot';
    holder.dataset.signal = name;
    const close = document.createElement('button');
    close.textContent = '✕';
    close.title = 'take this plot away';
    const title = document.createElement('span'), newest = document.createElement('output');
    title.textContent = name;
    holder.append(close, title, newest);
    this.place.append(holder);
    const chart = new uPlot({
      width: Math.max(this.place.clientWidth, 200), height: 130, legend: {show: false}, scales: {x: {time: false}},
      axes: [{size: 24, ...AXIS}, {size: 56, ...AXIS}],
      series: [{label: 's'}, {label: name, stroke: COLORS[this.plots.length % COLORS.length], width: 1.5, points: {show: false}}],
    }, [[], []], holder);
    const plot = {name, chart, x: [], y: [], holder, newest};
    close.onclick = () => {
      this.plots = this.plots.filter((other) => other !== plot);
      chart.destroy();
      holder.remove();
      this.changed();
    };
    this.plots.push(plot);
    this.changed();
  }

  // The topics that are needed.
  wants(topic) { return this.plots.some((plot) => plot.name.startsWith(`${topic}.`)); }

  // The numbers of a sample of this topic. `epoch` is not known of all topics: joint states have the form that ROS 2 gave them.
  take(topic, time, epoch, values) {
    if (epoch !== undefined) {
      if (epoch !== this.epoch) this.clear();  // the cell was reset: time is zero again
      this.epoch = epoch;
    }
    for (const plot of this.plots) if (plot.name.startsWith(`${topic}.`)) this.append(plot, time, values.get(plot.name) ?? null);
  }

  // null: the sample has no such number, e.g. of two parts that do not press. The line has a gap from the first such sample to
  // the newest one.
  append(plot, time, value) {
    if (time < plot.x.at(-1)) { plot.x.length = 0; plot.y.length = 0; }  // a recording went back
    if (value === null && !plot.x.length) return;
    const end = plot.x.length - 1;
    if (plot.x[end] === time && plot.y[end] === value) return;
    const longer = value === null && plot.y[end] === null && plot.y[end - 1] === null;
    if (longer || plot.x[end] === time) {  // a standing cell may have changed
      plot.x[end] = time;
      plot.y[end] = value;
    } else {
      plot.x.push(time);
      plot.y.push(value);
    }
    if (plot.x.length > MOST) { plot.x.splice(0, MOST / 4); plot.y.splice(0, MOST / 4); }
    plot.dirty = true;
  }

  draw() {
    for (const plot of this.plots) {
      if (!plot.dirty) continue;
      plot.dirty = false;
      plot.chart.setData([plot.x, plot.y]);
      plot.newest.textContent = plot.y.at(-1)?.toPrecision(5) ?? (plot.y.length ? 'none' : '');
    }
  }

  // The theme of the page has changed.
  repaint() { for (const {chart} of this.plots) chart.redraw(false); }

  clear() { for (const plot of this.plots) { plot.x.length = 0; plot.y.length = 0; plot.dirty = true; } }
}
