// Scales of the picture: colours from small to large values of a quantity, and their ends in words.
import * as THREE from 'three';

export class Ramp {
  constructor(...colors) { this.colors = colors.map((color) => new THREE.Color(color)); }
  // `part`: from 0 to 1.
  color(part, color = new THREE.Color()) {
    const {colors} = this, at = Math.min(Math.max(part, 0), 1) * (colors.length - 1), i = Math.min(Math.floor(at), colors.length - 2);
    return color.copy(colors[i]).lerp(colors[i + 1], at - i);
  }
  get gradient() { return `linear-gradient(90deg,${Array.from({length: 9}, (one, i) => `#${this.color(i / 8).getHexString()}`).join()})`; }
}
export const PRESSURE = new Ramp(0x2b3cff, 0x18b8d8, 0x2fbf4a, 0xf2d21b, 0xe2231a);
export const HEAT = new Ramp(0x2b4aa0, 0x8147a8, 0xcf4468, 0xf58a35, 0xfbe45c);
export const FORCES = new Ramp(0x3b7dd8, 0x8a4fd0, 0xd6204e);

// The least of 1, 2, 5 times a power of ten that is as large.
export function roundUp(value) {
  const ten = 10 ** Math.floor(Math.log10(value)), found = [1, 2, 5, 10].find((one) => one * ten >= value * (1 - 1e-9)) * ten;
  return Number(found.toPrecision(1));
}

export const roundDown = (value) => { const up = roundUp(value); return up > value * (1 + 1e-9) ? [5, 2, 1].map((one) => one * 10 ** Math.floor(Math.log10(value))).find((one) => one <= value) : up; };

// With the prefix that leaves one to three digits in front of the point.
export function quantity(value, unit) {
  const [factor, prefix] = [[1e9, 'G'], [1e6, 'M'], [1e3, 'k'], [1, ''], [1e-3, 'm'], [1e-6, 'µ']].find(([one]) => Math.abs(value) >= 0.9999 * one) ?? [1, ''];
  return `${Number((value / factor).toPrecision(3))} ${prefix}${unit}`;
}

// From zero to a round end, which stays while the largest value is above a fifth of it.
export class Scale {
  constructor(ramp, unit) { Object.assign(this, {ramp, unit, end: 0}); }
  clear() { this.end = 0; }
  take(largest) {
    if (!(largest > 0) || !Number.isFinite(largest)) return;
    const end = roundUp(largest);
    if (end > this.end || end <= this.end / 5) this.end = end;
  }
  color(value, color) { return this.ramp.color(this.end > 0 ? value / this.end : 0, color); }
  get text() { return `0 to ${quantity(this.end, this.unit)}`; }
}
