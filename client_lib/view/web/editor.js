// The file of the loaded scenario in an editor: completion and sentences by the schema, errors at their line by the server's
// own reader, saving and loading again.
import {autocompletion} from '@codemirror/autocomplete';
import {yaml} from '@codemirror/lang-yaml';
import {linter, lintGutter} from '@codemirror/lint';
import {Compartment, EditorState} from '@codemirror/state';
import {hoverTooltip, keymap} from '@codemirror/view';
import {indentWithTab} from '@codemirror/commands';
import {basicSetup, EditorView} from 'codemirror';
import {$, make} from './dom.js';
import {ControlResult} from './messages.js';
import schema from './scenario.schema.json';
import {errorAt, formsAt, keysAt, placeOf, sentenceOf, valuesAt} from './scenario_schema.js';

const CHECK_AFTER = 500;  // ms without typing

function complete(context) {
  const {state, pos} = context, line = state.doc.lineAt(pos), lines = state.doc.toString().split('\n');
  const at = placeOf(lines, line.number - 1, pos - line.from), written = at.key ?? at.value ?? '';
  if (line.text.slice(0, pos - line.from).includes('#') || (!context.explicit && !written && at.value === null)) return null;
  const options = at.value === null
    ? keysAt(schema, at.path, at.siblings).map(({label, info, required, below}) => ({label, info, type: 'property', detail: required ? 'required' : '', boost: required ? 1 : 0, apply: `${label}:${below ? '' : ' '}`}))
    : valuesAt(schema, at.path).map(({label, info}) => ({label, detail: info, type: 'enum'}));
  return options.length ? {from: pos - written.length, options} : null;
}

const explain = hoverTooltip((view, pos) => {
  const line = view.state.doc.lineAt(pos), lines = view.state.doc.toString().split('\n');
  const word = line.text.slice(0, pos - line.from).search(/[\w.-]*$/), end = pos - line.from + line.text.slice(pos - line.from).search(/[^\w.-]|$/);
  if (!/^\s*:/.test(line.text.slice(end))) return null;
  const at = placeOf(lines, line.number - 1, word), sentence = sentenceOf(formsAt(schema, [...at.path, line.text.slice(word, end)]));
  return sentence ? {pos: line.from + word, end: line.from + end, create: () => ({dom: make('div', sentence, {class: 'explained'})})} : null;
});

// ask(request, arguments, aside, wait), refusal(), closed().
export function openEditor({ask, refusal, closed}) {
  const host = $('editor-text'), writing = new Compartment();
  let saved = '', canSave = false, uri = '';
  const request = (name, args, wait) => ask(name, args, true, wait).catch(({message}) => ({result: ControlResult.failed, message}));
  const say = (sentence, bad = false) => { $('editor-answer').textContent = sentence; $('editor-answer').className = bad ? 'fault' : ''; };
  const changed = () => view.state.doc.toString() !== saved;
  const mark = () => {
    $('editor-name').textContent = `${uri.split('/').at(-1)}${changed() ? ' •' : ''}`;
    $('editor-name').title = uri;
    const why = refusal() || (canSave ? '' : 'The files of this server are read-only; takt-server --edit lets the page replace them.');
    for (const id of ['editor-save', 'editor-run']) Object.assign($(id), {disabled: Boolean(why), title: why || $(id).textContent});
  };
  const check = linter(async ({state}) => {
    if (!changed() && !saved) return [];
    const {result, message} = await request('save_scenario_text', {text: state.doc.toString(), only_check: true});
    if (result === ControlResult.ok) { say('valid'); return []; }
    const at = errorAt(message) ?? {line: 0, column: 0, message}, line = state.doc.line(Math.min(at.line + 1, state.doc.lines));
    const from = Math.min(line.from + Math.max(at.column, 0), line.to);
    say(`line ${line.number}: ${at.message}`, true);
    return [{from, to: Math.max(line.to, from), severity: 'error', message: at.message}];
  }, {delay: CHECK_AFTER});
  const save = async () => {
    const text = view.state.doc.toString();
    const {result, message} = await request('save_scenario_text', {text});
    if (result === ControlResult.ok) saved = text;
    say(message, result !== ControlResult.ok);
    mark();
    return result === ControlResult.ok;
  };
  const run = async () => {
    if (!(await save())) return;
    const {result, message} = await request('reload_scenario', {}, say);
    say(message, result !== ControlResult.ok);
  };
  const view = new EditorView({parent: host, state: EditorState.create({extensions: [
    keymap.of([{key: 'Mod-s', run: () => { if (!$('editor-save').disabled) save(); return true; }}, {key: 'Mod-Enter', run: () => { if (!$('editor-run').disabled) run(); return true; }}, indentWithTab]),
    basicSetup, yaml(), lintGutter(), check, explain, autocompletion({override: [complete]}), writing.of(EditorState.readOnly.of(true)),
    EditorView.updateListener.of(({docChanged}) => { if (docChanged) mark(); }), EditorView.contentAttributes.of({'aria-label': 'text of the scenario'})]})});
  $('editor-save').onclick = save;
  $('editor-run').onclick = run;
  $('editor-close').onclick = () => { $('editor').hidden = true; closed(); };
  return {
    view,
    async load() {
      $('editor').hidden = false;
      if (uri && changed()) { view.focus(); return; }  // what is typed stays
      const {result, message, values} = await request('get_scenario_text', {});
      if (result !== ControlResult.ok) { say(message, true); uri = ''; mark(); return; }
      ({uri, text: saved, can_save: canSave} = values);
      view.dispatch({changes: {from: 0, to: view.state.doc.length, insert: saved}, effects: writing.reconfigure(EditorState.readOnly.of(Boolean(refusal())))});
      saved = view.state.doc.toString();  // the editor has line ends of its own
      say('');
      mark();
      view.focus();
    },
  };
}
