// The programs of the cell's controllers, to be read: the line at which each robot is at the time that is shown is marked.
import {StreamLanguage} from '@codemirror/language';
import {lua} from '@codemirror/legacy-modes/mode/lua';
import {EditorState, RangeSet, StateEffect, StateField} from '@codemirror/state';
import {Decoration, GutterMarker, gutter} from '@codemirror/view';
import {basicSetup, EditorView} from 'codemirror';
import {$, make} from './dom.js';

const setLines = StateEffect.define();  // [{line, robots, says}]

class Robots extends GutterMarker {
  constructor(robots, says) { super(); Object.assign(this, {robots, says}); }
  eq(other) { return other.says === this.says; }
  toDOM() { return make('span', `▶ ${this.robots.join(', ')}`, {title: this.says}); }
}

const running = StateField.define({
  create: () => ({lines: Decoration.none, markers: RangeSet.empty}),
  update(value, transaction) {
    for (const effect of transaction.effects) {
      if (!effect.is(setLines)) continue;
      const {doc} = transaction.state, found = effect.value.filter(({line}) => line >= 1 && line <= doc.lines).sort((a, b) => a.line - b.line);
      value = {lines: Decoration.set(found.map(({line}) => Decoration.line({class: 'cm-running'}).range(doc.line(line).from))),
        markers: RangeSet.of(found.map(({line, robots, says}) => new Robots(robots, says).range(doc.line(line).from)))};
    }
    return value;
  },
  provide: (field) => EditorView.decorations.from(field, ({lines}) => lines),
});

// programs: what is known of them. state(): the state that is shown, or undefined. closed().
export class ProgramView {
  constructor({programs, state, closed}) {
    Object.assign(this, {programs, state, shown: null, marked: '', changes: -1});
    this.view = new EditorView({parent: $('program-text'), state: EditorState.create({extensions: [running, gutter({class: 'cm-robots', markers: (view) => view.state.field(running).markers}),
      basicSetup, StreamLanguage.define(lua), EditorState.readOnly.of(true), EditorView.contentAttributes.of({'aria-label': 'text of the program', tabindex: '0'})]})});
    $('program-which').onchange = () => this.fill();
    $('program-close').onclick = () => { $('program').hidden = true; closed(); };
  }

  open() {
    $('program').hidden = false;
    this.changes = -1;
    this.update();
    this.view.focus();
  }

  fill() {
    const chosen = this.list[Number($('program-which').value)] ?? null, same = chosen && this.shown && chosen.text === this.shown.text;
    this.shown = chosen;
    if (!same) {
      this.view.dispatch({changes: {from: 0, to: this.view.state.doc.length, insert: chosen?.text ?? ''}});
      this.marked = '';
    }
    this.update();
  }

  // Once a frame while it is seen.
  update() {
    if ($('program').hidden) return;
    if (this.changes !== this.programs.changes) {
      this.changes = this.programs.changes;
      const names = (this.list = this.programs.programs()).map(({file, controller, robots}) => `${file.split('/').at(-1)}: ${robots.join(', ')} (${controller})`);
      const select = $('program-which'), before = [...select.options].map(({textContent}) => textContent);
      if (names.join('\n') !== before.join('\n') || (this.list.length && !this.shown)) {
        const kept = Math.max(this.list.findIndex(({text, controller}) => text === this.shown?.text && controller === this.shown?.controller), 0);
        select.replaceChildren(...names.map((name, i) => new Option(name, i, false, i === kept)));
        this.fill();
      }
      $('program-none').hidden = this.list.length > 0;
    }
    const state = this.state(), lines = new Map(), says = [];
    for (const robot of this.shown?.robots ?? []) {
      const steps = state ? this.programs.at(robot, state.epoch, state.time) : [];
      if (!steps.length) continue;
      const path = steps.map(({name}) => name).join(' › '), {line} = steps.at(-1);
      if (!lines.has(line)) lines.set(line, []);
      lines.get(line).push({robot, path});
      says.push(`${robot}: ${path}`);
    }
    const marked = [...lines].map(([line, at]) => `${line}:${at.map(({robot, path}) => `${robot} ${path}`)}`).join(';');
    if (marked === this.marked) return;
    this.marked = marked;
    const sentence = says.join(', ');
    $('program-answer').textContent = sentence;
    $('program-answer').title = sentence;
    const effects = [setLines.of([...lines].map(([line, at]) => ({line, robots: at.map(({robot}) => robot), says: at.map(({robot, path}) => `${robot}: ${path}`).join('\n')})))];
    const [line] = lines.keys();
    if ($('program-follow').checked && line >= 1 && line <= this.view.state.doc.lines) effects.push(EditorView.scrollIntoView(this.view.state.doc.line(line).from, {y: 'nearest', yMargin: 60}));
    this.view.dispatch({effects});
  }
}
