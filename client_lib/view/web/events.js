// Events of the cell: those that repeat are gathered with a count.
import {Severity, nameOf} from './messages.js';

const MOST = 1000, LISTED = 100, WITHIN_S = 10;

// The same sentence with other numbers is the same event again; digits within a name count.
export const kindOf = ({severity, code, subject, message}) => [severity, code, subject, message.replace(/(?<![\w.])[-+]?\d+(\.\d+)?(e[-+]?\d+)?(?![\w.]*\w)/gi, '#')].join('\n');

// Groups of events in the order of their newest one: {events, newest}. One that comes again within a few seconds of simulated
// time is in the group of the one before.
export function gathered(events) {
  const open = new Map();
  let groups = [];
  for (const event of events) {
    const kind = kindOf(event), group = open.get(kind);
    if (group && Math.abs(event.time - group.newest.time) <= WITHIN_S) {
      group.events.push(event);
      group.newest = event;
    } else {
      const made = {events: [event], newest: event};
      open.set(kind, made);
      groups.push(made);
    }
  }
  return groups.sort((a, b) => (a.newest.sequence_number < b.newest.sequence_number ? -1 : 1));
}
export const saying = ({events, newest}) => (events.length > 1 ? `${events.length} × ${newest.message}` : newest.message);

export class Events {
  constructor(place, go) { Object.assign(this, {place, go, all: []}); }

  clear() { this.all = []; }

  // `at`: when it was recorded, s. A recording that goes back has its events again; a server that is started again numbers
  // them from 1. True: it is another one.
  take(event, at, recording) {
    const {all} = this;
    if (!recording && event.sequence_number === 1n && all.length) this.all = [];
    const before = all.findLastIndex(({sequence_number: number}) => number <= event.sequence_number);
    if (this.all === all && all[before]?.sequence_number === event.sequence_number) return false;
    this.all.splice(this.all === all ? before + 1 : 0, 0, {...event, at});
    if (this.all.length > MOST) this.all.shift();
    return true;
  }

  list() {
    this.place.replaceChildren(...gathered(this.all).slice(-LISTED).reverse().map((group) => {
      const {events, newest} = group, item = document.createElement('li'), button = document.createElement('button'), time = document.createElement('time');
      if (newest.severity !== Severity.information) item.className = nameOf(Severity, newest.severity);
      time.textContent = newest.time.toFixed(3);
      button.append(time, saying(group));
      button.title = events.length > 1 ? `first at ${events[0].time.toFixed(3)} s; shows the cell at the last one` : 'shows the cell then';
      button.onclick = () => this.go(newest);
      item.append(button);
      return item;
    }));
  }
}
