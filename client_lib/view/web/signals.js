// Signals: the numbers in samples by name, as `takt plot` and `takt export` call them.
export class Signals {
  constructor() { this.description = null; this.names = new Set(); }

  describe(description) { this.description = description; this.names.clear(); }

  // Calls visit(name, value) for the numbers of a sample.
  each(topic, sample, visit) {
    const walk = (value, name, list, named, holder) => {
      if (typeof value === 'number' || typeof value === 'bigint') visit(name, Number(value));
      else if (typeof value === 'boolean') visit(name, value ? 1 : 0);
      else if (Array.isArray(value) || ArrayBuffer.isView(value)) {
        for (let i = 0; i < value.length; ++i) {
          const described = typeof value[i] === 'object' ? this.description?.[list]?.[i] : named;
          walk(value[i], `${name}.${this.nameOf(value[i], i, list, named, holder)}`, '', described, holder);
        }
      } else if (value && typeof value === 'object')
        for (const [key, member] of Object.entries(value)) walk(member, `${name}.${key}`, key, named, value);
    };
    walk(sample, topic.replace(/^\/[^/]*\//, ''), '', null, null);
  }

  nameOf(element, i, list, named, holder) {
    if (element && typeof element === 'object') {
      const component = (index) => this.description?.components[index]?.name;
      if (typeof element.name === 'string') return element.name;
      if (typeof element.target === 'string') return element.target;
      if (component(element.base) && component(element.target)) return `${component(element.base)}-${component(element.target)}`;
      return this.description?.[list]?.[i]?.name ?? i;
    }
    // Joint states name their numbers beside them.
    return (Array.isArray(holder?.name) && list !== 'name' ? holder.name[i] : undefined) ?? named?.joints?.[i]?.name ?? named?.signals?.[i]?.name ?? i;
  }
}
