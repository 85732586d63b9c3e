// The programs that controllers run for robots: their texts, the steps that have begun, and which of them run at a time.
const TOPIC = /^(.+)\/(program|program_steps)$/, MOST = 5000;
export const isProgram = (topic) => TOPIC.test(topic);

export class Programs {
  constructor() { this.clear(); }
  clear() { Object.assign(this, {robots: new Map(), changes: (this.changes ?? 0) + 1}); }

  // True: it was one of their topics.
  take(topic, sample) {
    const [, robot, kind] = topic.match(TOPIC) ?? [];
    if (!kind) return false;
    if (!this.robots.has(robot)) this.robots.set(robot, {controller: '', file: '', text: '', epoch: null, steps: []});
    const one = this.robots.get(robot), {controller, file, text, epoch, time, steps} = sample;
    if (kind === 'program') Object.assign(one, {controller, file, text});
    else {
      // A sample has the newest steps. Of a recording that is played from an earlier place, later ones are known.
      const known = one.epoch === epoch ? one.steps : [], first = steps[0]?.begin ?? time;
      Object.assign(one, {epoch, steps: [...known.filter(({begin}) => begin < first), ...steps, ...known.filter(({begin}) => begin > time)].slice(-MOST)});
    }
    ++this.changes;
    return true;
  }

  // By name: their topics are found in any order.
  sorted() { return [...this.robots].sort(([a], [b]) => a.localeCompare(b, undefined, {numeric: true})); }

  // What the timeline shows of a robot since that reset of the cell: the sections that its program names, or else its calls.
  bars(reset) {
    return this.sorted().filter(([, {epoch}]) => epoch === reset).map(([robot, {steps}]) => ({robot, steps: steps.some(({named}) => named) ? steps.filter(({named}) => named) : steps})).filter(({steps}) => steps.length);
  }
  // The steps of a robot at a time after that reset, outer ones first.
  at(robot, reset, time) { return (this.robots.get(robot)?.epoch === reset ? this.robots.get(robot).steps : []).filter(({begin, end}) => begin <= time && (end < 0 || time < end)); }

  // Programs with the robots that they run for, each once.
  programs() {
    const found = new Map();
    for (const [robot, {controller, file, text}] of this.sorted()) {
      if (!text) continue;
      const key = `${controller}\n${file}\n${text}`;
      if (!found.has(key)) found.set(key, {controller, file, text, robots: []});
      found.get(key).robots.push(robot);
    }
    return [...found.values()];
  }
}
