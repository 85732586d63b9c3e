// The scene tree: components by kind, robots, grippers and devices; a search keeps what matches.
import {$} from './dom.js';
import {ComponentType} from './messages.js';


// What of a description can be selected: {kind, name, detail}.
export function nodesOf(description) {
  const own = new Set(description.grippers.flatMap(({palm, left_jaw: left, right_jaw: right}) => [palm, left, right]));
  const of = (title, type) => ({title, nodes: description.components.map(({name, type: is}, i) => ({kind: 'component', name, is, i})).filter(({is, i}) => is === type && !own.has(i))});
  const list = (title, kind, all) => ({title, nodes: all.map(({name, type}) => ({kind, name, detail: typeof type === 'string' ? type : ''}))});
  return [of('Parts', ComponentType.part), list('Robots', 'robot', description.robots), list('Grippers', 'gripper', description.grippers),
    list('Devices', 'device', description.devices ?? []), of('Grounds', ComponentType.ground)].filter(({nodes}) => nodes.length);
}

export class SceneTree {
  // chosen({kind, name}): a node was selected here.
  constructor(chosen) {
    this.items = new Map();
    $('nodes').addEventListener('wa-selection-change', ({detail}) => {
      const node = detail.selection.at(-1)?.takt;
      if (node && !this.quiet) chosen(node);
    });
    $('find').oninput = () => this.filter();
  }

  describe(description) {
    this.items.clear();
    $('nodes').replaceChildren(...nodesOf(description).map(({title, nodes}) => {
      const group = document.createElement('wa-tree-item');
      group.expanded = nodes.length <= 30;
      group.append(`${title} (${nodes.length})`);
      for (const node of nodes) {
        const item = document.createElement('wa-tree-item');
        item.takt = node;
        item.dataset.name = node.name;
        item.append(node.name);
        if (node.detail) { const small = document.createElement('small'); small.textContent = node.detail; item.append(small); }
        this.items.set(`${node.kind}:${node.name}`, item);
        group.append(item);
      }
      return group;
    }));
    this.filter();
  }

  // A selection that was made elsewhere is marked here too.
  mark(chosen) {
    this.quiet = true;
    for (const [key, item] of this.items) item.selected = chosen !== null && key === `${chosen.kind}:${chosen.name}`;
    const item = chosen && this.items.get(`${chosen.kind}:${chosen.name}`);
    if (item) { item.parentElement.expanded = true; item.scrollIntoView({block: 'nearest'}); }
    this.quiet = false;
  }

  filter() {
    const wanted = $('find').value.trim().toLowerCase();
    for (const group of $('nodes').children) {
      let any = false;
      for (const item of group.querySelectorAll('wa-tree-item')) any = !(item.hidden = !item.takt.name.toLowerCase().includes(wanted)) || any;
      group.hidden = !any;
      if (wanted && any) group.expanded = true;
    }
  }
}
