import {Cell, LONGEST, STATES, STATE_COLORS, OPEN, CLOSED, GRIPS, FORCE, CONTACT, HOLDS} from './cell.js';
import {download} from './curve_export.js';
import {addressed} from './address.js';
import {$, counted, make} from './dom.js';
import {ComponentType, Pace, PartState, SimulationState, nameOf} from './messages.js';
import {Eye, Ruler} from './eye.js';
import {Inspector} from './inspector.js';
import {Link} from './link.js';
import {Lower} from './lower.js';
import {Menu} from './menu.js';
import {Mover} from './mover.js';
import {isProgram} from './programs.js';
import {HEAT, PRESSURE, quantity, roundDown} from './scales.js';
import {SceneTree} from './scene_tree.js';
import {frame, keyboard} from './shell.js';

const RUNS = {no_scenario: 'no scenario', loading_scenario: 'loading'};
const WATCHES = 'Observers may look, not touch.';
const SHOWN = ['description', 'status', 'events', 'recorded_events', 'state', 'contacts'];
const identityOf = (description) => description && [description.cell, description.scenario, description.scenario_generation, ...description.components.map(({name}) => name)].join('\n');
const topicOf = (name) => name.replace(/^\/[^/]*\//, '');

// The last answer, whole where the pointer rests on it: there may be no room for all of it.
let fading;
function tell(sentence) {
  $('answer').textContent = $('answer').title = sentence;
  $('answer').classList.toggle('shown', Boolean(sentence));
  clearTimeout(fading);
  fading = setTimeout(() => $('answer').classList.remove('shown'), 6000);
}

const cell = new Cell($('cell'));
cell.onMissing = (names) => {
  tell(`${names.length === 1 ? 'The mesh file' : `${names.length} mesh files, among them`} ${names[0]} of a robot ${names.length === 1 ? 'is' : 'are'} not there; start takt view with --files FOLDER.`);
};
const eye = new Eye(cell), ruler = new Ruler(cell);
const last = {};       // newest sample of each topic
let playback = null;
const lower = new Lower({tell, seek: (position) => link.call('seek', {position}), changed: () => { remember(); subscribe(); }, show: lookAt});
const {signals, plots} = lower;
frame((dark) => { cell.paint(dark); lower.repaint(); });

// The view in the address, else the default view.
const asked = addressed(location.hash);
cell.setView(asked);
for (const [id, name, factor] of [['by-state', 'byState'], ['by-temperature', 'byTemperature'], ['by-force', 'byForce'], ['forces', 'forces'], ['contacts', 'contacts'], ['holding', 'holding'], ['edges', 'edges'], ['frames', 'frames'], ['scale', 'metresPerNewton', 1000]]) {
  const value = asked.options?.[name];
  if (typeof value !== (factor ? 'number' : 'boolean') || (factor && !(value >= 0 && value < 1e3))) continue;
  cell.options[name] = value;
  if (factor) $(id).value = Number((factor * value).toPrecision(6));
  else $(id).checked = value;
}
if (typeof asked.options?.follow === 'string') cell.options.follow = asked.options.follow;

const link = new Link(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/`, {
  open(info) {
    $('name').textContent = info.name;
    document.title = info.name;
    live = info.metadata.source !== 'file';
    quiet = 0;
    hear();
    const observer = info.metadata.control !== 'true' || new URLSearchParams(location.search).has('observer');
    for (const control of $('controls').querySelectorAll('button, input, select')) {
      control.dataset.says ??= control.title;
      Object.assign(control, {disabled: observer, title: observer ? WATCHES : control.dataset.says});
    }
    lower.open(info.metadata.source === 'file', observer);
    cell.files = info.metadata.files === 'true';
    subscribed.clear();
  },
  closed() {
    $('connection').textContent = 'not connected, trying again';
    $('connection').className = 'off';
  },
  sample(topic, sample, type, log, again) {
    const name = topicOf(topic);
    if (!isProgram(name)) last[name] = sample;
    if (name !== 'description') lower.sample(name, type, sample, log);
    (takes[name] ?? (() => {}))(sample, again);
  },
}, (channel) => {
  const name = topicOf(channel.topic);
  const wanted = (SHOWN.includes(name) && channel.schemaName !== 'sensor_msgs/msg/JointState') || name === 'playback' || isProgram(name) || wantsNow(name);
  if (wanted) subscribed.add(channel.id);
  return wanted;
});
// Seconds without a status, of which ten come each second. A page that is busy itself counts fewer.
let live = false, quiet = 0;
function hear() {
  const silent = live && quiet > 2;
  $('connection').textContent = silent ? `silent for ${quiet} s` : live ? 'connected' : 'recording';
  $('connection').title = silent ? 'takt-server has ended, stands still, or its machine is overloaded. The picture is the last one that came.' : '';
  $('connection').className = silent ? 'off' : '';
}
setInterval(() => {
  if (link.socket.readyState !== WebSocket.OPEN) return;
  ++quiet;
  hear();
}, 1000);
const subscribed = new Set();

// Topics that only plots need, or pictures of pressure.
function wantsNow(name) { return plots.wants(name) || (name === 'contact_pressures' && (playback !== null || $('pressure').value !== '')); }
function subscribe() {
  if (link.socket.readyState !== WebSocket.OPEN) return;
  const subscriptions = [];
  for (const channel of link.channels.values())
    if (!subscribed.has(channel.id) && wantsNow(topicOf(channel.topic))) {
      subscribed.add(channel.id);
      subscriptions.push({id: channel.id, channelId: channel.id});
    }
  if (subscriptions.length) link.say({op: 'subscribe', subscriptions});
}

const takes = {
  description(description) {
    if (playback && identityOf(description) === identityOf(signals.description)) return;  // it comes again at each place of a recording
    lower.describe(description, asked.plots);
    cell.describe(description);
    $('heated').hidden = !cell.heat.of.size;
    tree.describe(description);
    const names = description.components.map(({name}) => name);
    $('follow').replaceChildren(new Option('nothing', ''), ...names.map((name) => new Option(name)));
    if (names.includes(cell.options.follow)) $('follow').value = cell.options.follow;
    else cell.options.follow = '';
    const before = generation;
    if (last.state) takes.state(last.state);
    provisional = generation !== before;  // that state may be of the cell before
    for (const topic of ['contacts', 'contact_pressures'])
      if (last[topic]?.scenario_generation === description.scenario_generation) takes[topic](last[topic]);
    select(wanted ?? chosen);
    if (chosen?.name === wanted?.name) wanted = null;
  },
  // A picture that a sample does not change is not drawn again: that takes a processor where there is no graphics card.
  state(state, again = false) {
    if (!lower.past.shown) {
      if (!again || mover.strayed) cell.show(state);
      mover.strayed = false;
      first();
    }
    drawn.state = drawn.graph = true;
  },
  // Topics arrive in any order: what names components by number waits for the description.
  contacts(contacts, again = false) {
    if (!cell.description) return;
    if (!lower.past.shown && !again) cell.showContacts(contacts);
    listPairs(contacts.contacts.map(({base, target}) => pairName(base, target)));
  },
  contact_pressures(sample, again = false) {
    if (!cell.description || again) return;
    const chosen = $('pressure').value;
    const pairs = sample.pairs.filter(({base, target}) => chosen === '*' || chosen === pairName(base, target));
    if (lower.past.shown) return;
    cell.showPressures({pairs});
    if (last.contacts) cell.showContacts(last.contacts);
    pressureLegend(pairs);
    if (playback) listPairs(sample.pairs.map(({base, target}) => pairName(base, target)));
  },
  status() {
    drawn.status = true;
    const before = quiet;
    quiet = 0;
    if (before > 2) hear();
  },
  playback(at) {
    if (!playback) { playback = at; subscribe(); }
    playback = at;
    drawn.status = true;
  },
};

// The picture of a time of the past, or of the present again. Pressures are those of the present alone.
function lookAt() {
  const {shown} = lower.past;
  if (shown || last.state) cell.show(lower.state);
  cell.showPressures({pairs: []});
  if (shown || last.contacts) cell.showContacts({contacts: shown ? shown.contacts : last.contacts.contacts});
  if (!shown && last.contact_pressures) takes.contact_pressures(last.contact_pressures);
  drawn.state = drawn.graph = true;
}

// --- drawing: what has changed, at most once a frame ----------------------------------------------------------------
const drawn = {};

function rows() {
  const {status: s} = last, {state} = lower;
  const number = (value, digits) => Number(value).toFixed(digits);
  const list = [['time', state ? `${number(state.time, 3)} s (step ${state.step})` : '-']];
  if (s) {
    const run = nameOf(SimulationState, s.state);
    list.push(['state', RUNS[run] ?? run], ['pace', `${nameOf(Pace, s.pace)}${s.pace === Pace.realtime ? ` x ${number(s.pace_factor, 2)}` : ''}`],
      ['real-time factor', number(s.real_time_factor, 3)], ['computation ratio', number(s.computation_ratio, 4)],
      ['overruns', `${s.overruns} (lag ${number(1e3 * s.lag, 1)} ms)`], ['step p50 / p99', `${number(1e6 * s.step_time_p50, 0)} / ${number(1e6 * s.step_time_p99, 0)} µs`],
      ['solver', s.solver]);
    if (s.waiting_for.length) list.push(['waiting for', s.waiting_for.join(', ')]);
    if (s.fault) list.push(['fault', s.fault, 'fault']);
  }
  const {description} = signals;
  state?.grippers.forEach((gripper, i) => {
    const stands = gripper.moving ? 'moving' : gripper.in_position ? 'in position' : 'stands';
    const on = gripper.part >= 0 ? `on ${description?.components[gripper.part]?.name}, ${number(gripper.force, 1)} N` : 'no part';
    list.push([description?.grippers[i]?.name ?? 'gripper', `${number(1e3 * gripper.width, 1)} mm, ${stands}, ${on}`]);
  });
  const listed = JSON.stringify(list);
  if ($('status').dataset.key !== listed) {
    $('status').dataset.key = listed;
    $('status').replaceChildren(...list.map(([what, value, kind]) => {
      const row = make('tr', '');
      row.append(make('td', what), make('td', value, kind ? {class: kind} : {}));
      return row;
    }));
  }
  if (s) {
    const key = s.processes.map(({name, level_of_detail: level}) => `${name}:${level}`).join();
    if ($('levels').dataset.key !== key) {
      $('levels').dataset.key = key;
      $('levels').replaceChildren(...s.processes.map(({name, level_of_detail: level}) => {
        const label = make('label', s.processes.length === 1 ? 'LoD ' : `${name} LoD `), choice = make('select', '');
        for (const n of [1, 2, 3]) choice.append(new Option(n, n, false, n === level));
        Object.assign(choice, {disabled: observer(), title: observer() ? WATCHES : 'level of detail'});
        choice.onchange = () => ask('set_level_of_detail', {level_of_detail: Number(choice.value), process: name});
        label.append(choice);
        return label;
      }));
    }
    if (document.activeElement !== $('pace')) $('pace').value = nameOf(Pace, s.pace);
  }
}

// Holding relations: holders left, parts right.
function graph() {
  const {description} = signals, {state} = lower;
  if (!description || !state) return;
  const parts = description.components.map((component, i) => ({...state.components[i], name: component.name, type: component.type, i})).filter(({type, state: s}) => type === ComponentType.part && s !== PartState.parked);
  const key = parts.map(({partner, state: s}) => `${partner}:${s}`).join();
  if ($('graph').dataset.key === key) return;
  $('graph').dataset.key = key;
  const holders = [...new Set(parts.map(({partner}) => partner).filter((partner) => partner >= 0))].sort((a, b) => a - b);
  const height = 22 * Math.max(parts.length, holders.length, 1), y = (i) => 11 + 22 * i;
  const drawing = [];
  parts.forEach((part, i) => {
    const color = `#${(STATE_COLORS[part.state] ?? 0).toString(16).padStart(6, '0')}`;
    drawing.push(make('svg:circle', '', {cx: 230, cy: y(i), r: 5, fill: color}), make('svg:text', `${part.name}: ${STATES[part.state] ?? ''}`, {x: 242, y: y(i)}));
    if (part.partner >= 0) drawing.push(make('svg:line', '', {x1: 110, y1: y(holders.indexOf(part.partner)), x2: 224, y2: y(i), stroke: color, 'stroke-width': 2}));
  });
  holders.forEach((holder, i) => drawing.push(make('svg:text', description.components[holder].name, {x: 104, y: y(i), 'text-anchor': 'end'})));
  $('graph').setAttribute('viewBox', `0 0 380 ${height}`);
  $('graph').replaceChildren(...drawing);
}

// The scales of what is shown in colours.
function scales() {
  const {heat, options, scales: {force, pressure}, pressed, largest} = cell;
  const pressing = options.contacts && cell.patches?.some(({disc}) => disc.visible) && pressure.end > 0;
  for (const [id, shown, text] of [['heat-scale', options.byTemperature && heat.of.size > 0, () => heat.ends.map((value) => `${value.toFixed(0)} °C`).join(' to ')],
    ['force-scale', options.byForce && force.end > 0 && (options.forces || options.contacts), () => force.text], ['pressure-scale', pressing, () => pressure.text]]) {
    const scale = $(id);
    if (scale.hidden === Boolean(shown)) scale.hidden = !shown;
    if (shown && scale.lastChild.textContent !== text()) scale.lastChild.textContent = text();
  }
}

function draw() {
  requestAnimationFrame(draw);
  if (drawn.status || drawn.state) {
    rows();
    for (const [id, pressed] of [['play', SimulationState.playing], ['pause', SimulationState.paused], ['stop', SimulationState.stopped]]) {
      const is = String(phase() === pressed);
      if ($(id).ariaPressed !== is) $(id).ariaPressed = is;
    }
    const time = last.state ? `${lower.state.time.toFixed(3)} s` : '';
    if (time && $('clock').textContent !== time) $('clock').textContent = time;
    inspector.update(lower.state, last.status);
    handles();
    scales();
  }
  if (drawn.graph) graph();
  lower.draw();
  program?.update();
  for (const key of Object.keys(drawn)) delete drawn[key];
}
requestAnimationFrame(draw);

// --- controls -------------------------------------------------------------------------------------------------------
// `aside`: the sentence of the answer is not shown. `wait` gets the seconds of an answer that takes long.
function ask(request, args, aside = false, wait = aside ? () => {} : tell) {
  return counted(link.call(request, args), wait).then((reply) => { if (!aside) tell(`${reply.message} ${lower.warning()}`.trim()); return reply; },
    (error) => { if (!aside) tell(error.message); throw error; });
}
const on = (id, request, args = () => ({})) => { $(id).onclick = () => ask(request, args()).catch(() => {}); };
// Of a recording: whether it is played, whatever the cell did.
const phase = () => (!playback ? last.status?.state : playback.playing ? SimulationState.playing : SimulationState.paused);
on('play', 'set_state', () => ({state: 'playing'}));
on('pause', 'set_state', () => ({state: 'paused'}));
on('stop', 'set_state', () => ({state: 'stopped'}));
on('step', 'step', () => ({steps: Number($('steps').value)}));
on('reset', 'reset');
$('pace').append(...Object.keys(Pace).map((pace) => new Option(pace)));
$('pace').onchange = $('factor').onchange = () =>
  ask('set_pace', {pace: $('pace').value, ...($('pace').value === nameOf(Pace, Pace.realtime) ? {factor: Number($('factor').value)} : {})}).catch(() => {});

// --- pressures ------------------------------------------------------------------------------------------------------
const pairName = (base, target) => `${signals.description?.components[base]?.name}-${signals.description?.components[target]?.name}`;
function listPairs(names) {
  for (const name of names)
    if (![...$('pressure').options].some(({value}) => value === name)) $('pressure').append(new Option(name));
}
function pressureLegend(pairs) {
  $('pressures').hidden = !pairs.length;
  $('pressures').replaceChildren(make('i', '', {style: `background:${PRESSURE.gradient}`}), '0 to the largest of each pair:',
    ...pairs.map((pair) => make('div', `${pairName(pair.base, pair.target)}: ${quantity(pair.largest_pressure, 'Pa')}, ${pair.pressures.length} elements${pair.omitted ? ` of ${pair.pressures.length + pair.omitted}` : ''}`)));
}
// The server sends pressures while a client repeats its request. A recording has the pressures that were requested during it.
function askForPressures(again) {
  const pairs = $('pressure').value;
  if (pairs && !playback && link.service && !$('play').disabled) ask('watch_pressures', {pairs: [pairs], duration: 15}, again).catch(() => {});
}
setInterval(() => askForPressures(true), 5000);
$('pressure').onchange = () => {
  if (!$('pressure').value) takes.contact_pressures({pairs: []});
  else if (last.contact_pressures) takes.contact_pressures(last.contact_pressures);
  subscribe();
  askForPressures();
};

const option = (id, name, value) => { $(id).onchange = () => { cell.options[name] = value($(id)); if (last.state) lookAt(); cell.setEdges(cell.options.edges); cell.setFrames(cell.options.frames); remember(); }; };
option('by-state', 'byState', (box) => box.checked);
option('by-force', 'byForce', (box) => box.checked);
option('by-temperature', 'byTemperature', (box) => box.checked);
option('forces', 'forces', (box) => box.checked);
option('contacts', 'contacts', (box) => box.checked);
option('holding', 'holding', (box) => box.checked);
option('edges', 'edges', (box) => box.checked);
option('frames', 'frames', (box) => box.checked);
option('scale', 'metresPerNewton', (box) => Number(box.value) / 1000);
option('follow', 'follow', (box) => box.value);
const section = () => { $('cut').hidden = !$('section').value; cell.setSection($('section').value, $('cut').value); remember(); };
$('section').onchange = $('cut').oninput = section;
if (asked.section) { $('section').value = asked.section; $('cut').value = asked.cut; section(); }

// The address says what one looks at, so that it can be passed on. Any other view fits the cell on any screen.
function remember() {
  const {camera, target, ...rest} = cell.view(), view = {...(asked.camera || eye.past.length ? {camera, target} : {}), ...rest, plots: plots.names()};
  history.replaceState(null, '', `#${encodeURIComponent(JSON.stringify(view))}`);
}
cell.orbit.addEventListener('end', remember);
$('link').onclick = () => {
  remember();
  const here = () => tell('The address above is that of this view: copy it from there.');
  if (!navigator.clipboard) here();  // browsers give it to pages of this machine and of https only
  else navigator.clipboard.writeText(location.href).then(() => tell('The address of this view is on the clipboard.'), here);
};
$('screenshot').onclick = async () => {
  download(await cell.picture(), `takt_${(lower.state?.time ?? 0).toFixed(3)}s.png`);
};
const inside = (kind, ...children) => { const made = make(kind); made.append(...children); return made; };
const mark = (color, name, kind = '') => inside('span', make('i', '', {class: kind, style: `background:#${color.toString(16).padStart(6, '0')}`}), name);
const line = (...children) => inside('div', ...children);
$('legend').replaceChildren(line('parts', ...Object.entries(STATES).map(([state, name]) => mark(STATE_COLORS[state], name))), line('grippers', mark(OPEN, 'open'), mark(CLOSED, 'commanded to close'), mark(GRIPS, 'on a part')),
  line('marks', mark(FORCE, 'force on a part', 'line'), mark(CONTACT, 'contact', 'line'), mark(HOLDS, 'holding relation', 'line')));
for (const [id, ramp] of [['heat-scale', HEAT], ['force-scale', cell.scales.force.ramp], ['pressure-scale', PRESSURE]]) $(id).querySelector('i').style.background = ramp.gradient;

// --- what is looked at, and what is selected ------------------------------------------------------------------------
let chosen = null, wanted = null, fitted = Boolean(asked.camera), generation = null, provisional = false;
const inspector = new Inspector({ask, select, refusal: () => (playback ? 'A recording cannot be changed.' : observer() ? WATCHES : lower.past.shown ? 'The picture shows the past: go back to live first.' : link.socket.readyState !== WebSocket.OPEN ? 'There is no connection to the cell.' : '')});
const tree = new SceneTree(select);
const menu = new Menu({ask, refusal: () => inspector.refusal(), scenario: () => signals.description?.scenario,
  place: () => cell.orbit.target.toArray(), added: (name) => {
    if (signals.description.components.some((one) => one.name === name)) select({kind: 'component', name}); else wanted = {kind: 'component', name};
  }});
const mover = new Mover(cell, ({name, position, orientation}) => ask('set_entity_state', {entity: name, position, orientation}).catch(() => { if (last.state) cell.show(last.state); }));
// The editor is loaded when it is first wanted.
let editor = null;
async function edit() {
  if (!$('editor').hidden) { $('editor-close').click(); return; }
  editor ??= (await import('./editor.js')).openEditor({ask, refusal: () => inspector.refusal(), closed: () => $('cell').focus()});
  await editor.load();
}
$('edit').onclick = () => edit();
let program = null;
async function readProgram() {
  if (!$('program').hidden) { $('program-close').click(); return; }
  program ??= new (await import('./program_view.js')).ProgramView({programs: lower.programs, state: () => lower.state, closed: () => $('cell').focus()});
  program.open();
}
$('read-program').onclick = () => readProgram();
// A Part has handles while they are asked for, it is selected and the cell stands.
let moving = null;
function handles() {
  const part = signals.description?.components.find(({name}) => chosen?.kind === 'component' && name === chosen.name);
  const may = moving && part?.type === ComponentType.part && !inspector.refusal() && [SimulationState.paused, SimulationState.stopped].includes(last.status?.state);
  const mesh = may ? cell.chosen : null;
  if (mesh !== (mover.handles.object ?? null) || (mesh && mover.mode !== moving)) mover.take(mesh, moving);
  for (const [id, mode] of [['move', 'translate'], ['turn', 'rotate']]) $(id).setAttribute('aria-pressed', String(moving === mode));
}
function move(mode) {
  moving = moving === mode ? null : mode;
  handles();
  if (moving && !mover.handles.object) tell(inspector.refusal() || (chosen?.kind !== 'component' ? 'Select a Part to move it.' : last.status?.state === SimulationState.playing ? 'Pause the cell to move a Part.' : 'Only Parts can be moved.'));
}
$('move').onclick = () => move('translate');
$('turn').onclick = () => move('rotate');
const STEPS = {ArrowLeft: ['x', -1], ArrowRight: ['x', 1], ArrowDown: ['y', -1], ArrowUp: ['y', 1], PageDown: ['z', -1], PageUp: ['z', 1]};
const nudge = ({key, shiftKey}) => { const [axis, sign] = STEPS[key]; mover.nudge(axis, sign * (moving === 'translate' ? 0.001 : Math.PI / 180) * (shiftKey ? 10 : 1)); };
function observer() { return $('play').disabled; }
// Tree, picture and inspector show the same one; null: nothing.
function select(what) {
  const there = what && signals.description?.[`${what.kind}s`]?.some(({name}) => name === what.name);
  chosen = there ? {kind: what.kind, name: what.name} : null;
  if (!signals.description || !last.state) return;
  cell.select(chosen);
  handles();
  tree.mark(chosen);
  inspector.open(chosen, signals.description, lower.state, last.status);
}
// The first picture of a cell has all of it, unless the address says otherwise; so has that of another scenario.
function first() {
  const now = signals.description?.scenario;
  if (!cell.description || (generation === now && generation !== null && !provisional)) return;
  if (generation !== null && generation !== now) fitted = false;
  generation = now;
  provisional = false;
  const box = eye.bounds();
  if (!box) return;
  const size = box.getSize(new box.min.constructor());
  cell.lay(box.getCenter(new box.min.constructor()), Math.max(0.6 * size.length(), 0.1), Math.min(box.min.z, 0));
  if (!fitted) eye.fit('iso', null, false);
}
cell.onSize = cell.onGrown = () => { if (!fitted && generation !== null && !eye.past.length) eye.fit('iso', null, false); };
cell.onDraw = () => {
  const {length, pixels} = eye.scale();
  const [bar, arrow] = $('scale-bar').children, newton = cell.options.metresPerNewton * pixels / length, shown = (cell.options.forces || cell.options.contacts) && newton > 0;
  bar.firstChild.style.width = `${pixels.toFixed(0)}px`;
  bar.lastChild.textContent = length >= 1 ? `${length} m` : `${Number((1000 * length).toPrecision(2))} mm`;
  // The longest arrow of a round force that has room beside it.
  arrow.hidden = !shown;
  if (!shown) return;
  const force = roundDown(Math.min(120, LONGEST * pixels / length) / newton);
  arrow.firstChild.style.width = `${(force * newton).toFixed(0)}px`;
  arrow.lastChild.textContent = quantity(force, 'N');
};
// A key that its button refuses has the button's reason.
const press = (id) => () => { if ($(id).disabled) tell($(id).title); else $(id).click(); };
for (const button of document.querySelectorAll('[data-camera]')) button.onclick = () => eye.side(button.dataset.camera);
$('fit').onclick = () => eye.fit(null, cell.chosen);
$('back').onclick = () => eye.back();
const toggle = (id, changed) => { $(id).onclick = () => { const now = $(id).getAttribute('aria-pressed') !== 'true'; $(id).setAttribute('aria-pressed', String(now)); changed(now); }; };
toggle('orthographic', (now) => eye.orthographic(now));
toggle('measure', (now) => { ruler.clear(); $('aim').hidden = !now; tell(now ? 'Measure: click two points, or press Enter for the one in the middle.' : ''); });
let pressedAt = null;
$('cell').addEventListener('pointerdown', (event) => { pressedAt = [event.clientX, event.clientY]; $('hint').hidden = true; });
$('cell').addEventListener('pointerup', (event) => {
  if (!pressedAt || event.button !== 0 || Math.hypot(event.clientX - pressedAt[0], event.clientY - pressedAt[1]) > 4) return;
  if (mover.over) return;  // a handle was meant
  const hit = eye.pick(event);
  if (measuring()) take(hit); else select(hit?.chosen ?? null);
});
const measuring = () => $('measure').getAttribute('aria-pressed') === 'true';
const take = (hit) => tell(hit ? ruler.take(hit) : 'There is no surface at that point.');
const onTimeline = () => document.activeElement === $('position');
const inView = () => document.activeElement === $('cell') && !mover.handles.object;
let hovered = 0;
$('cell').addEventListener('pointermove', (event) => {
  if (event.buttons || performance.now() - hovered < 100) return;
  hovered = performance.now();
  const hit = eye.pick(event, true);
  $('hint').hidden = !hit?.says;
  if (hit?.says) Object.assign($('hint'), {textContent: hit.says}), Object.assign($('hint').style, {left: `${event.offsetX + 14}px`, top: `${event.offsetY + 10}px`});
});
$('cell').addEventListener('pointerleave', () => { $('hint').hidden = true; });
const camera = (name) => () => document.querySelector(`[data-camera=${name}]`).click();
keyboard([
  [' ', 'run or pause', () => press(phase() === SimulationState.playing ? 'pause' : 'play')()], ['.', 'step', press('step')], ['R', 'reset', press('reset')], ['s', 'stop', press('stop')],
  ['f', 'fit to the cell, or to what is selected', press('fit')], ['1', 'isometric; this and the next three again: from the other side', camera('iso')], ['2', 'front', camera('front')], ['3', 'right', camera('right')], ['4', 'top', camera('top')],
  ['o', 'orthographic or perspective', press('orthographic')], ['z', 'previous view', press('back')], ['m', 'measure between two points', press('measure')], ['g', 'move the selected Part', press('move')], ['h', 'turn the selected Part', press('turn')],
  [Object.keys(STEPS), 'move it by 1 mm or 1°, with Shift by ten', nudge, () => moving && mover.handles.object], ['n', 'scenario, snapshots, recording', press('menu')], ['y', 'scenario file in the editor', press('edit')], ['p', 'programs of the robots', press('read-program')], ['Escape', 'select nothing', () => select(null)],
  ['c', 'colour by state', press('by-state')], ['e', 'edges', press('edges')], ['a', 'frames (axes)', press('frames')], ['/', 'find a component', () => { if (document.body.classList.contains('no-tree')) $('fold-tree').click(); $('find').focus(); }],
  ['u', 'colour forces by their size', press('by-force')], ['k', 'colour by temperature', () => { if (!$('heated').hidden) $('by-temperature').click(); }],
  ['Enter', 'measure: take the point in the middle', () => take(eye.pick(eye.middle())), () => document.activeElement === $('cell') && measuring()],
  [['ArrowLeft', 'ArrowRight', 'ArrowUp', 'ArrowDown'], 'turn the view, with Shift move it', ({key, shiftKey}) => eye.turn(key, shiftKey), inView], [['+', '-'], 'nearer, farther', ({key}) => eye.near(key === '-' ? 1.25 : 0.8), inView],
  [['+', '-'], 'timeline: nearer, farther', ({key}) => lower.timeline.zoom(key === '-' ? -1 : 1), onTimeline], ['0', 'timeline: all of the time', () => lower.timeline.fit(), onTimeline],
  [['ArrowLeft', 'ArrowRight'], 'timeline: with Shift earlier, later', ({key}) => lower.timeline.move(key === 'ArrowLeft' ? -0.1 : 0.1), ({shiftKey}) => shiftKey && onTimeline()],
  ['t', 'scene tree', press('fold-tree')], ['i', 'inspector', press('fold-inspector')], ['b', 'timeline and curves', press('fold-bottom')], ['d', 'light or dark theme', press('theme')], ['l', 'live again, out of the history', press('live')], ['?', 'this list', press('help')],
]);

// For tests and for the console of the browser.
window.takt = {cell, eye, mover, link, last, lower, plots, select, selected: () => chosen, place: (name) => cell.place(name)};
