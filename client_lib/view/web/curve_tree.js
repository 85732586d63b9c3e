// The signals that one can choose from, as a tree with units: groups, robots or parts, quantities. A search keeps what has all
// of its words.
import {$} from './dom.js';
import {levelsOf} from './signals.js';

const MOST_FOUND = 200, FIRST = ['Robots', 'Components', 'Grippers', 'Devices', 'Contacts', 'Power'];
const rank = (title) => (FIRST.includes(title) ? FIRST.indexOf(title) : FIRST.length);

export class CurveTree {
  // add(name, apart): to the plot that is chosen, or apart from all.
  constructor(add) {
    Object.assign(this, {add, names: new Map(), root: new Map(), listed: null});
    const tree = $('signals'), leaf = (event) => event.composedPath().find((one) => one.localName === 'wa-tree-item' && one.takt !== undefined);
    tree.addEventListener('keydown', (event) => {
      const at = document.activeElement?.takt;
      if (event.key !== 'Enter' || at === undefined) return;
      event.preventDefault();
      event.stopPropagation();
      this.add(at, event.shiftKey);
    }, {capture: true});
    tree.addEventListener('click', (event) => { const item = leaf(event); if (item) this.add(item.takt, event.shiftKey); });
    tree.addEventListener('dragstart', (event) => { const item = leaf(event); if (item) event.dataTransfer.setData('text/plain', item.takt); });
    tree.addEventListener('wa-lazy-load', ({target}) => { this.fill(target, target.node); target.lazy = false; });
    $('signal').oninput = () => this.draw();
    $('signal').onkeydown = (event) => {
      if (event.key === 'Enter') this.addFound(event.shiftKey);
      if (event.key === 'ArrowDown') { event.preventDefault(); $('signals').querySelector('wa-tree-item')?.focus(); }
    };
    $('add-plot').onclick = () => this.addFound(true);
  }

  clear() {
    this.names.clear();
    this.root.clear();
    this.draw();
  }
  has(name) { return this.names.has(name); }
  // True: it is another one. draw() shows it.
  offer(name, unit) {
    if (this.names.has(name)) return false;
    this.names.set(name, unit);
    const levels = levelsOf(name);
    let node = this.root;
    for (const level of levels.slice(0, -1)) {
      if (!(node.get(level) instanceof Map)) node.set(level, new Map());
      node = node.get(level);
    }
    node.set(levels.at(-1), name);
    return true;
  }

  // What was typed, where it is a name; else the first that was found.
  addFound(apart) {
    const typed = $('signal').value.trim(), name = this.names.has(typed) || typed.includes('.') ? typed : this.found()[0];
    if (!name || !typed) return;
    this.add(name, apart);
    $('signal').value = '';
    this.draw();
  }
  found() {
    const words = $('signal').value.trim().toLowerCase().split(/\s+/);
    const found = [...this.names.keys()].filter((name) => words.every((word) => name.toLowerCase().includes(word)));
    return found.map((name) => [rank(levelsOf(name)[0]), name]).sort(([a], [b]) => a - b).map(([, name]) => name);
  }

  draw() {
    if (!$('signal').value.trim()) {
      this.root = new Map([...this.root].sort(([a], [b]) => rank(a) - rank(b)));
      this.listed = null;
      this.fill($('signals'), this.root);
      return;
    }
    const found = this.found(), key = found.join('\n');
    if (key === this.listed) return;
    this.listed = key;
    const items = found.slice(0, MOST_FOUND).map((name) => this.leaf(levelsOf(name).join(' '), name));
    if (found.length > MOST_FOUND) items.push(Object.assign(document.createElement('wa-tree-item'), {disabled: true, textContent: `and ${found.length - MOST_FOUND} others`}));
    if (!found.length) items.push(Object.assign(document.createElement('wa-tree-item'), {disabled: true, textContent: 'no such signal'}));
    $('signals').replaceChildren(...items);
  }

  leaf(text, name) {
    const item = document.createElement('wa-tree-item'), unit = document.createElement('small');
    item.takt = name;
    item.title = name;
    item.draggable = true;
    unit.textContent = this.names.get(name);
    item.append(text, unit);
    return item;
  }
  // A branch has its children once it is opened. When signals are added, what is there stays: open, and with the focus.
  fill(place, node) {
    const before = [...place.children].filter(({localName}) => localName === 'wa-tree-item'), there = new Map(before.map((item) => [item.node ?? item.takt, item]));
    const children = [...node].map(([text, of]) => {
      const kept = there.get(of);
      if (kept?.node && !kept.lazy) this.fill(kept, of);
      if (kept) return kept;
      if (!(of instanceof Map)) return this.leaf(text, of);
      const item = document.createElement('wa-tree-item');
      item.node = of;
      item.lazy = true;
      item.append(text);
      return item;
    });
    const stays = new Set(children);
    for (const item of before) if (!stays.has(item)) item.remove();
    children.forEach((item, i) => {
      const next = i ? children[i - 1].nextElementSibling : [...place.children].find(({localName}) => localName === 'wa-tree-item') ?? null;
      if (next !== item) place.insertBefore(item, next);
    });
  }
}
