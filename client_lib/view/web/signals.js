// Signals: the numbers in samples by name, as `takt plot` and `takt export` call them, with their units.
import {messages} from './messages.js';

// Messages of ROS 2 have no units; these have the quantities of one of ours.
const SAME = {'sensor_msgs/msg/JointState': 'takt_msgs/msg/RobotState'};

// Where a tree of signals has a name: its group, and the levels below.
export function levelsOf(name) {
  const [topic, ...rest] = name.split('.'), [holder, kind] = topic.split('/');
  const title = (word) => word[0].toUpperCase() + word.slice(1).replaceAll('_', ' ');
  if (kind) return [title(kind), holder, ...rest];
  if (topic === 'state') return rest.length > 1 ? [title(rest[0]), ...rest.slice(1)] : ['Cell', ...rest];
  return [title(topic), ...(rest.length > 1 ? rest.slice(1) : rest)];
}

// A value with as many digits as one can read, and its unit.
export function valueText(value, unit = '') {
  if (value === null || value === undefined) return 'none';
  const size = Math.abs(value);
  const digits = Number.isInteger(value) && size < 1e9 ? String(value) : size >= 1e-3 && size < 1e5 ? value.toPrecision(5) : size >= 1e5 && size < 1e9 ? value.toFixed(0) : value.toExponential(3);
  return unit ? `${digits} ${unit}` : digits;
}

export class Signals {
  constructor() { this.description = null; }

  describe(description) { this.description = description; }

  // Calls visit(name, value, unit) for the numbers of a sample of this type; `wanted`: of these names alone.
  each(topic, type, sample, visit, wanted = null) {
    const robot = this.description?.robots?.find(({name}) => topic.startsWith(`${name}/`));
    this.fields(topic, type, sample, robot ?? this.description, '', visit, wanted);
  }

  // `described`: what the description says of the holder. `unit`: of a holder whose fields have none.
  fields(name, type, holder, described, unit, visit, wanted) {
    const units = messages[SAME[type]] ?? {};
    for (const [key, field] of Object.entries(messages[type] ?? {})) {
      const value = holder[key], full = `${name}.${key}`;
      if (!field.signal || value === undefined || (wanted && !wanted.some((one) => one.startsWith(full)))) continue;
      const order = field.order ?? units[key]?.order, of = field.unit ?? units[key]?.unit ?? unit;
      if (field.list) {
        for (let i = 0; i < value.length; ++i) {
          const element = `${full}.${this.nameOf(field, holder, value[i], i, described)}`;
          if (!wanted || wanted.some((one) => one.startsWith(element))) this.one(element, field, value[i], described?.[order]?.[i], of, visit, wanted);
        }
      } else this.one(full, field, value, described, of, visit, wanted);
    }
  }

  one(name, field, value, described, unit, visit, wanted) {
    if (field.type) this.fields(name, field.type, value, described, unit, visit, wanted);
    else if (!wanted || wanted.includes(name)) visit(name, Number(value), unitOf(unit, described));
  }

  // Of an element: by its key, or that of the description's list; else what its indices name (a pair), or the names beside it.
  nameOf(field, holder, element, i, described) {
    if (field.key) return element[field.key];
    if (field.order) return described?.[field.order]?.[i]?.name ?? i;
    const indices = Object.entries(messages[field.type] ?? {}).filter(([, {index}]) => index);
    if (indices.length) return indices.map(([key, {index}]) => this.description?.[index]?.[element[key]]?.name).join('-');
    return (Array.isArray(holder.name) ? holder.name[i] : undefined) ?? i;
  }
}

// "1" is that of a pure number. Of a joint the unit for its type, as "rad | m" lists them; of a signal that of its device.
function unitOf(unit, described) {
  if (unit.startsWith('of ')) return described?.unit ?? '';
  return unit.includes(' | ') ? unit.split(' | ')[described?.type] ?? '' : unit === '1' ? '' : unit;
}
