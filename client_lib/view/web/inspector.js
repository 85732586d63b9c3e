// The inspector: what a selected component, robot, gripper or device is, and what may be done with it.
import {ComponentType, PartState, SignalType, SimulationState, nameOf} from './messages.js';
import {STATES} from './cell.js';
import {$, angles, make, numberOf, three} from './dom.js';
import {temperatureAt, temperatures} from './heat.js';
import {gripperPendant, robotPendant, signalControls} from './pendant.js';

const place = $('selection');
export const shown = (value, type) => (type === SignalType.boolean ? (value ? 'true' : 'false') : Number(value.toPrecision(5)).toString());

export class Inspector {
  // ask(request, arguments), select(chosen), refusal(): why nothing may be changed, or ''.
  constructor({ask, select, refusal}) {
    Object.assign(this, {ask, select, refusal, chosen: null, place, waiting: []});
    this.clear();
  }

  clear() { place.replaceChildren(make('h2', 'Nothing selected'), make('p', 'Click a component in the tree or in the picture.')); }

  open(chosen, description, state, status) {
    Object.assign(this, {chosen, description, state, status, updates: [], controls: [], asked: null});
    if (!chosen) return this.clear();
    const {kind, name} = chosen, list = description[`${kind}s`] ?? [];
    this.index = list.findIndex((one) => one.name === name);
    if (this.index < 0) return this.clear();
    place.replaceChildren(make('h2', name));
    this.reason = make('p', '', {class: 'why'});
    place.append(this.reason);
    this[kind](list[this.index]);
    this.update(state, status);
  }

  table(title) {
    if (title) place.append(make('h3', title));
    this.rows = make('table');
    place.append(this.rows);
  }
  row(what, read, ...more) {
    const line = make('tr'), value = make('td');
    line.append(make('td', what), value);
    if (more.length) { const cell = make('td'); cell.append(...more); line.append(cell); }
    this.rows.append(line);
    this.updates.push(() => { const text = String(read()); if (value.textContent !== text) value.textContent = text; });
  }
  // `free`: why this one may not be pressed now, or ''.
  button(text, request, args, free = () => '') {
    const made = make('button', text);
    made.onclick = () => this.ask(request, args()).catch(() => {});
    this.controls.push({made, free});
    return made;
  }
  actions(...children) { const line = make('div', '', {class: 'actions'}); line.append(...children); place.append(line); }
  input(value, attributes) {
    const made = make('input', '', {type: 'number', step: 'any', ...attributes});
    made.value = value;
    this.controls.push({made, free: () => ''});
    return made;
  }

  component(of) {
    const now = () => this.state.components[this.index], part = of.type === ComponentType.part;
    this.table();
    this.row('kind', () => nameOf(ComponentType, of.type));
    this.row('state', () => STATES[now().state] ?? nameOf(PartState, now().state));
    if (part) {
      this.row('held by', () => this.description.components[now().partner]?.name ?? 'nothing');
      this.row('mass', () => `${Number(of.mass.toPrecision(4))} kg`);
      this.row('hierarchy', () => of.hierarchy);
    }
    this.level();
    const heat = temperatures(this.description).get(this.index);
    if (heat) this.row('temperature', () => `${temperatureAt(this.state, heat).toFixed(1)} °C`);
    this.row('position', () => `${three(now().position, 1000, 2)} mm`);
    this.row('roll pitch yaw', () => `${three(angles(now().orientation), 1, 2)}°`);
    this.row('velocity', () => `${three(now().linear_velocity, 1000, 1)} mm/s`);
    this.row('force', () => `${three(now().force, 1, 2)} N`);
    this.row('torque', () => `${three(now().torque, 1, 3)} N m`);
    if (part) {
      const stands = () => ([SimulationState.paused, SimulationState.stopped].includes(this.status?.state) ? '' : 'pause the cell first');
      const stopped = () => (this.status?.state === SimulationState.stopped ? '' : 'stop the cell first');
      place.append(make('h3', 'Place, mm'));
      const at = ['x', 'y', 'z'].map((axis) => this.input((1000 * now().position[axis]).toFixed(3), {'aria-label': `${axis} in mm`, style: 'width:6em'}));
      this.actions(...at, this.button('put', 'set_entity_state', () => ({entity: of.name, position: at.map((field) => numberOf(field) / 1000)}), stands));
      this.actions(this.button('copy', 'spawn_entity', () => ({name: `${of.name}_copy`, allow_renaming: true, copy_of: of.name, position: [now().position.x, now().position.y, now().position.z + 0.1]}), stopped),
        this.button('delete', 'delete_entity', () => ({entity: of.name}), stopped));
    }
    this.explain(of.name);
  }

  explain(name) {
    const text = make('p');
    const button = make('button', 'explain');
    button.onclick = () => this.ask('explain_part', {part: name}).then(({values, message}) => { text.textContent = values?.explanation ?? message; }, (error) => { text.textContent = error.message; });
    this.controls.push({made: button, free: () => ''});
    this.actions(button);
    place.append(text);
  }

  // The level of detail: of the cell, or of each process that it is simulated in.
  level() {
    this.row('level of detail', () => (this.status?.processes ?? []).map(({name, level_of_detail: level}, i, {length}) => (length > 1 ? `${name} ${level}` : level)).join(', '));
  }

  robot(of) { robotPendant(this, of); }

  gripper(of) {
    const now = () => this.state.grippers[this.index];
    this.table();
    this.row('width', () => `${(1000 * now().width).toFixed(2)} mm of ${(1000 * of.max_width).toFixed(1)}`);
    this.row('force', () => `${now().force.toFixed(2)} N, ${of.max_force} N at most`);
    this.row('commanded', () => (now().closed ? 'closed' : 'open'));
    this.row('stands', () => (now().moving ? 'moving' : now().in_position ? 'in position' : 'stands'));
    this.row('part', () => this.description.components[now().part]?.name ?? 'nothing');
    gripperPendant(this, of);
    place.append(make('h3', 'Forced values'));
    this.actions(this.button('force closed', 'force_signal', () => ({signal: `${of.name}.close`, value: 1})), this.button('force open', 'force_signal', () => ({signal: `${of.name}.close`, value: 0})),
      this.button('release', 'release_signal', () => ({signal: `${of.name}.close`}), () => (now().forced ? '' : 'no signal of it is forced')));
    this.explain(this.description.components[of.palm]?.name ?? of.name);
  }

  device(of) {
    const now = () => this.state.devices[this.index];
    this.table('signals');
    of.signals.forEach((signal, i) => {
      const value = this.input(now().signals[i], {'aria-label': `value for ${signal.name}`});
      const forced = () => Boolean(now().forced & (1 << i));
      this.row(signal.name, () => `${shown(now().signals[i], signal.type)} ${signal.unit}${forced() ? ' (forced)' : ''}${signal.wire ? `, wire: ${signal.wire}` : ''}`, value, ...signalControls(this, of, signal, value, forced));
    });
  }

  // Resolves when the cell has simulated so long from now on, or stands, or was reset.
  after(duration) {
    const end = this.state.time + duration, {epoch} = this.state;
    return new Promise((done) => this.waiting.push({end, epoch, done}));
  }

  update(state, status) {
    const over = ({end, epoch}) => !state || state.time >= end || state.epoch !== epoch || status?.state !== SimulationState.playing;
    this.waiting = this.waiting.filter((one) => { if (!over(one)) return true; one.done(); return false; });
    if (!this.chosen || !state || this.index < 0 || state.components.length !== this.description.components.length) return;
    Object.assign(this, {state, status});
    for (const update of this.updates) update();
    const why = this.refusal();
    if (this.reason.textContent !== why) this.reason.textContent = why;
    for (const {made, free} of this.controls) {
      const refused = why || free();
      if (made.disabled !== Boolean(refused)) made.disabled = Boolean(refused);
      if (made.title !== refused) made.title = refused;
    }
  }
}
