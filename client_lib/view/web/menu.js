// The menu of the cell: scenarios, snapshots and recordings of the server, by its own requests.
import {$, make} from './dom.js';

const age = (seconds) => (seconds < 90 ? `${Math.round(seconds)} s ago` : seconds < 5400 ? `${Math.round(seconds / 60)} min ago` : seconds < 172800 ? `${Math.round(seconds / 3600)} h ago` : `${Math.round(seconds / 86400)} days ago`);
const size = (bytes) => (bytes < 1e6 ? `${Math.ceil(bytes / 1e3)} kB` : `${(bytes / 1e6).toFixed(1)} MB`);

export class Menu {
  // ask(request, arguments, aside, wait): aside: its sentence is not shown; wait gets the seconds of a long answer. refusal(): why nothing may be changed, or ''.
  // place(): where a Part comes, m. added(name).
  constructor({ask, refusal, scenario, place, added}) {
    Object.assign(this, {ask, refusal, scenario});
    $('menu').onclick = () => this.open();
    const on = (id, request, args, after = () => this.list()) => { $(id).onclick = async () => { try { const answer = await ask(request, args(), false, (message) => this.say({message})); this.made = answer.values?.entity; this.say(answer); await after(); } catch (error) { this.say(error); } }; };
    const level = () => ($('load-level').value ? {level_of_detail: Number($('load-level').value)} : {});
    on('load', 'load_scenario', () => ({uri: $('scenario-file').value.trim(), ...level()}));
    on('reload', 'reload_scenario', () => ({}));
    on('unload', 'unload_scenario', () => ({}));
    on('save', 'save_snapshot', () => ({name: $('snapshot-name').value.trim()}));
    on('restore-newest', 'restore_snapshot', () => ({}));
    on('record', 'start_recording', () => ({name: $('recording-name').value.trim()}));
    on('record-stop', 'stop_recording', () => ({}));
    on('part-add', 'spawn_entity', () => {
      const uri = $('part-file').value.trim(), [x, y, z] = place();
      return {name: $('part-name').value.trim() || uri.split('/').at(-1).replace(/\.\w+$/, '').replace(/[^\w-]/g, '_'), allow_renaming: true, uri,
        ...($('part-mass').value ? {mass: Number($('part-mass').value)} : {}), mesh_scale: Number($('part-unit').value), position: [x, y, z]};
    }, () => added(this.made));
    // A folder that is named is looked into.
    $('part-file').onchange = async () => {
      const folder = $('part-file').value.trim();
      if (!folder || /\.\w+$/.test(folder)) return;
      const answer = await this.ask('get_spawnables', {sources: [folder]}, true).catch((error) => error), files = (answer.values?.spawnables ?? []).filter(({uri}) => uri);
      $('part-files').replaceChildren(...files.map(({uri, description}) => make('option', description, {value: uri})));
      this.say({message: files.length ? `${folder} has ${files.length === 1 ? 'a mesh file' : `${files.length} mesh files`}.` : answer.message || `${folder} has no mesh file.`});
    };
    for (const [field, button] of [['part-mass', 'part-add'], ['part-name', 'part-add'], ['scenario-file', 'load'], ['snapshot-name', 'save'], ['recording-name', 'record']])
      $(field).addEventListener('keydown', (event) => { if (event.key === 'Enter') $(button).click(); });
  }

  open() {
    $('cell-menu').open = true;
    this.say({message: this.refusal()});
    const stamp = new Date().toISOString().slice(0, 19).replace(/[-:]/g, '').replace('T', '_');
    for (const id of ['snapshot-name', 'recording-name']) if (!$(id).value) $(id).value = stamp;
    this.list();
  }

  say({message}) { $('menu-answer').textContent = message ?? ''; }

  // What the server has; without it a file can be named all the same.
  async list() {
    const refused = this.refusal();
    for (const one of $('cell-menu').querySelectorAll('button, input, select')) one.disabled = Boolean(refused);
    $('scenario-now').textContent = this.scenario() || 'none';
    if (refused) return;
    const {scenarios = []} = (await this.ask('get_scenarios', {}, true).catch(() => ({}))).values ?? {};
    $('scenario-files').replaceChildren(...scenarios.map(({uri, scenario, description}) => {
      const row = make('li'), load = make('button', scenario || uri.split('/').at(-1), {title: `load ${uri}`});
      load.onclick = () => { $('scenario-file').value = uri; $('load').click(); };
      row.append(load, make('span', description || uri));
      return row;
    }));
    $('scenario-list').hidden = !scenarios.length;
    const answer = await this.ask('get_snapshots', {}, true).catch((error) => error), snapshots = answer.values?.snapshots ?? [];
    $('snapshot-files').replaceChildren(...snapshots.map(({name, bytes, age: seconds}) => {
      const row = make('li'), restore = make('button', name, {title: `restore ${name}`});
      restore.onclick = async () => this.say(await this.ask('restore_snapshot', {name}).catch((error) => error));
      row.append(restore, make('span', `${age(seconds)}, ${size(bytes)}`));
      return row;
    }));
    const kept = Array.isArray(answer.values?.snapshots);
    if (!kept) $('snapshot-files').replaceChildren(make('li', answer.message));
    for (const id of ['save', 'restore-newest', 'snapshot-name']) $(id).disabled = !kept;
  }
}
