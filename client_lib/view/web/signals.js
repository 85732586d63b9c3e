// Signals: the numbers in samples by name, as `takt plot` and `takt export` call them.
import {messages} from './messages.js';

export class Signals {
  constructor() { this.description = null; }

  describe(description) { this.description = description; }

  // Calls visit(name, value) for the numbers of a sample of this type.
  each(topic, type, sample, visit) { this.fields(topic, type, sample, this.description, visit); }

  // `described`: what the description says of the holder.
  fields(name, type, holder, described, visit) {
    for (const [key, field] of Object.entries(messages[type] ?? {})) {
      const value = holder[key], full = `${name}.${key}`;
      if (!field.signal || value === undefined) continue;
      if (field.list) for (let i = 0; i < value.length; ++i) this.one(`${full}.${this.nameOf(field, holder, value[i], i, described)}`, field, value[i], described?.[field.order]?.[i], visit);
      else this.one(full, field, value, described, visit);
    }
  }

  one(name, field, value, described, visit) {
    if (field.type) this.fields(name, field.type, value, described, visit);
    else visit(name, Number(value));
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
