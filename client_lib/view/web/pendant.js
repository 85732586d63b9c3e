// The teach pendant in the inspector: joints and tool centre point by steps, grippers and devices by commands. Only what no
// other sender owns, while the cell runs.
import {GripperAction, JogFrame, JointType, SimulationState, nameOf} from './messages.js';
import {make, numberOf} from './dom.js';

const DEG = 180 / Math.PI;
// Of a joint: how it is shown and typed.
const unitOf = ({type}) => (type === JointType.prismatic ? {factor: 1000, unit: 'mm', digits: 2} : {factor: DEG, unit: '°', digits: 2});

// Why this one may not be commanded by hand, or ''.
export function refusalOf(status, target) {
  const owner = status?.owners?.find((one) => one.target === target)?.sender ?? '';
  if (owner && !owner.startsWith('pendant-')) return `It is commanded by ${owner}.`;
  return status?.state === SimulationState.playing ? '' : 'Run the cell first.';
}

function choice(label, options, value) {
  const select = make('select', '', {'aria-label': label, title: label});
  for (const [name, one] of options) select.append(new Option(name, one, false, one === value));
  return select;
}

// A button that sends a step, and another one each time the robot stands, while it is held down. It is busy until the page
// shows the robot at rest.
function stepper(inspector, text, label, free, step) {
  const made = make('button', text, {class: 'jog', 'aria-label': label});
  let held = false;
  const go = async () => {
    if (made.ariaBusy === 'true') return;
    made.ariaBusy = 'true';
    try {
      do {
        const {values} = await step();
        await inspector.after(values?.duration ?? 0);
      } while (held && !made.disabled);
    } catch { /* its sentence was shown */ }
    made.ariaBusy = 'false';
  };
  made.addEventListener('pointerdown', (event) => { if (event.button === 0) { held = true; go(); } });
  for (const end of ['pointerup', 'pointerleave', 'pointercancel', 'blur']) made.addEventListener(end, () => { held = false; });
  made.addEventListener('click', (event) => { if (event.detail === 0) go(); });  // by key
  inspector.controls.push({made, free});
  return made;
}

export function robotPendant(inspector, of) {
  const now = () => inspector.state.robots[inspector.index], free = () => refusalOf(inspector.status, of.name);
  const {place} = inspector;
  inspector.table();
  inspector.row('commanded by', () => inspector.status?.owners?.find(({target}) => target === of.name)?.sender || 'no sender');
  inspector.level();
  // --- joints ---
  place.append(make('h3', 'Joints'));
  const units = of.joints.map(unitOf), turns = units.some(({unit}) => unit === '°'), slides = units.some(({unit}) => unit === 'mm');
  const steps = {'°': choice('step of a turning joint', [0.1, 1, 5, 15].map((n) => [`${n}°`, n]), 5), mm: choice('step of a sliding joint', [0.1, 1, 10, 100].map((n) => [`${n} mm`, n]), 10)};
  const speed = choice('part of the largest speed', [5, 10, 25, 50, 100].map((n) => [`${n} %`, n / 100]), 0.25);
  for (const select of [...Object.values(steps), speed]) inspector.controls.push({made: select, free: () => ''});
  inspector.actions(make('span', 'step'), ...(turns ? [steps['°']] : []), ...(slides ? [steps.mm] : []), make('span', 'speed'), speed);
  const move = (positions) => inspector.ask('jog_joints', {robot: of.name, positions, speed: Number(speed.value)});
  const table = make('table', '', {class: 'joints'});
  of.joints.forEach((joint, i) => {
    const {factor, unit, digits} = units[i];
    const limited = joint.lower < joint.upper;
    const line = make('tr'), value = make('input', '', {type: 'number', step: 'any', 'aria-label': `${joint.name} in ${unit === '°' ? 'degrees' : unit}`});
    const bar = make('meter', '', {'aria-hidden': 'true'}), effort = make('div', '', {class: 'small'});
    if (limited) Object.assign(bar, {min: joint.lower, max: joint.upper});
    const to = (target) => move([...now().position].map((q, k) => (k === i ? (limited ? Math.min(Math.max(target, joint.lower), joint.upper) : target) : q)));
    const by = (sign) => () => to(now().position[i] + sign * Number(steps[unit].value) / factor);
    value.onkeydown = (event) => { if (event.key === 'Enter') { to(numberOf(value) / factor).catch(() => {}); value.blur(); } };
    inspector.controls.push({made: value, free});
    const cells = [make('td', joint.name), make('td'), make('td'), make('td')];
    cells[0].append(effort);
    cells[0].title = limited ? `${(factor * joint.lower).toFixed(1)} to ${(factor * joint.upper).toFixed(1)} ${unit}` : 'without limits';
    cells[1].append(stepper(inspector, '−', `${joint.name} back`, free, by(-1)));
    cells[2].append(value, ...(limited ? [bar] : []));
    cells[3].append(stepper(inspector, '+', `${joint.name} forth`, free, by(1)));
    line.append(...cells);
    table.append(line);
    inspector.updates.push(() => {
      const {position, velocity, effort: drive} = now();
      if (document.activeElement !== value) { const text = (factor * position[i]).toFixed(digits); if (value.value !== text) value.value = text; }
      if (limited) bar.value = position[i];
      const text = `${(factor * velocity[i]).toFixed(1)} ${unit}/s${drive[i] ? `, ${drive[i].toFixed(1)} ${unit === '°' ? 'N m' : 'N'}` : ''}`;
      if (effort.textContent !== text) effort.textContent = text;
    });
  });
  place.append(table);
  // --- tool centre point ---
  place.append(make('h3', 'Tool centre point, on a straight line'));
  const index = inspector.index, tools = inspector.description.grippers.filter(({robot}) => robot === index).map(({name}) => name);
  const tool = choice('tool centre point of', [...tools.map((name) => [name, name]), ['flange', '']], tools[0] ?? ''), frame = choice('axes of', Object.keys(JogFrame).map((name) => [name, name]), nameOf(JogFrame, JogFrame.world));
  const length = choice('step', [0.1, 1, 10, 50, 100].map((n) => [`${n} mm`, n]), 10), turn = choice('turn', [0.1, 1, 5, 15, 45].map((n) => [`${n}°`, n]), 5);
  for (const select of [tool, frame, length, turn]) inspector.controls.push({made: select, free: () => ''});
  inspector.actions(tool, frame, length, turn);
  const grid = make('div', '', {class: 'axes', role: 'group', 'aria-label': 'tool centre point'});
  const line = (kind, axis, sign) => () => inspector.ask('jog_line', {robot: of.name, gripper: tool.value, frame: frame.value, speed: 0.4 * Number(speed.value),
    [kind]: ['x', 'y', 'z'].map((one) => (one === axis ? sign * (kind === 'translation' ? Number(length.value) / 1000 : Number(turn.value) / DEG) : 0))});
  for (const [kind, title] of [['translation', ''], ['rotation', 'r']])
    for (const sign of [-1, 1])
      for (const axis of ['x', 'y', 'z']) grid.append(stepper(inspector, `${title}${axis}${sign < 0 ? '−' : '+'}`, `${title}${axis}${sign < 0 ? '−' : '+'}: ${kind === 'rotation' ? 'turn about' : 'along'} ${axis}`, free, line(kind, axis, sign)));
  place.append(grid);
  inspector.actions(inspector.button('stop', 'stop_jogging', () => ({robot: of.name}), free));
}

export function gripperPendant(inspector, of) {
  const free = () => refusalOf(inspector.status, of.name);
  inspector.place.append(make('h3', 'Commands'));
  const width = inspector.input((1000 * of.max_width).toFixed(1), {'aria-label': 'width in mm', min: 0, max: 1000 * of.max_width});
  const action = (name, more = () => ({})) => inspector.button(name, 'command_gripper', () => ({gripper: of.name, action: name, ...more()}), free);
  inspector.actions(action(nameOf(GripperAction, GripperAction.open)), action(nameOf(GripperAction, GripperAction.close)), width, make('span', 'mm'),
    inspector.button('move', 'command_gripper', () => ({gripper: of.name, action: nameOf(GripperAction, GripperAction.width), width: numberOf(width) / 1000}), free));
}

// The controls of one signal of a device: a command where it takes one, and forcing.
export function signalControls(inspector, of, signal, value, forced) {
  const name = `${of.name}.${signal.name}`, number = () => numberOf(value);
  const set = signal.commanded && !signal.wire ? [inspector.button('set', 'command_signal', () => ({device: of.name, signal: signal.name, value: number()}), () => refusalOf(inspector.status, of.name))] : [];
  return [...set, inspector.button('force', 'force_signal', () => ({signal: name, value: number()})), inspector.button('release', 'release_signal', () => ({signal: name}), () => (forced() ? '' : 'It is not forced.'))];
}
