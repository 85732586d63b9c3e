// The signals that one can choose from, as a tree with units: groups, robots or parts, quantities. A search keeps what has all
// of its words.
import {levelsOf} from './signals.js';

const $ = (id) => document.getElementById(id);
const MOST_FOUND = 200, FIRST = ['Robots', 'Components', 'Grippers', 'Devices', 'Contacts', 'Power'];
const rank = (title) => (FIRST.includes(title) ? FIRST.indexOf(title) : FIRST.length);

export class CurveTree {
  // add(name, apart): to the plot that is chosen, or apart from all.
  constructor(add) {
    Object.assign(this, {add, names: new Map(), root: new Map(), drawn: ''});
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
      this.fill($('signals'), this.root);
      return;
    }
    const found = this.found(), items = found.slice(0, MOST_FOUND).map((name) => this.leaf(levelsOf(name).join(' '), name));
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
  // A branch has its children once it is opened. One that is open stays so when signals are added.
  fill(place, node) {
    const open = new Map([...place.children].filter(({node: one, lazy}) => one && !lazy).map((item) => [item.node, item]));
    const children = [...node].map(([text, of]) => {
      if (!(of instanceof Map)) return this.leaf(text, of);
      const kept = open.get(of);
      if (kept) { this.fill(kept, of); return kept; }
      const item = document.createElement('wa-tree-item');
      item.node = of;
      item.lazy = true;
      item.append(text);
      return item;
    });
    if (place === $('signals')) place.replaceChildren(...children);
    else { for (const child of [...place.children]) if (child.localName === 'wa-tree-item') child.remove(); place.append(...children); }
  }
}
