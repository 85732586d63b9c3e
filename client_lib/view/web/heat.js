// Temperatures of Parts: the signals that have them, and their colours from the coldest to the hottest one of the scenario.
import {HEAT} from './scales.js';

const LEAST_K = 10;  // of the scale

// Device and signal with the temperature of each component that has one, by its number: the device PART_heat.
export function temperatures({components, devices = []}) {
  const heated = new Map(devices.map(({name, type, signals}, device) => [name, {device, signal: type === 'heat' ? signals.findIndex((one) => one.name === 'temperature') : -1}]));
  return new Map(components.map(({name}, i) => [i, heated.get(`${name}_heat`)]).filter(([, at]) => at?.signal >= 0));
}
// degC; null: the state has none.
export const temperatureAt = (state, {device, signal}) => state.devices[device]?.signals[signal] ?? null;

export class Heat {
  constructor() { Object.assign(this, {of: new Map(), low: 0, high: LEAST_K}); }

  describe(description) {
    this.of = temperatures(description);
    Object.assign(this, {low: Infinity, high: -Infinity});
  }

  // degC; null: this component has none.
  at(state, component) {
    const at = this.of.get(component);
    return at ? temperatureAt(state, at) : null;
  }

  take(state) {
    for (const component of this.of.keys()) {
      const value = this.at(state, component);
      if (value !== null) Object.assign(this, {low: Math.min(this.low, value), high: Math.max(this.high, value)});
    }
  }

  get ends() { return [this.low, Math.max(this.high, this.low + LEAST_K)]; }

  color(value, color) {
    const [low, high] = this.ends;
    return HEAT.color((value - low) / (high - low), color);
  }
}
