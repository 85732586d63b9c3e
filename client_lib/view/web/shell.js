// The frame of the page: icons, theme, panels that fold, keys and their list.
import {Box, FileCode, FolderOpen, Keyboard, ListVideo, Maximize, Move3d, MoveHorizontal, PanelBottom, PanelLeft, PanelRight, Pause, Play, Rotate3d, RotateCcw, Ruler, Square, StepForward, SunMoon, Undo2, X, ZoomIn, ZoomOut, createElement} from 'lucide';
import '@awesome.me/webawesome/dist/styles/themes/default.css';
import '@awesome.me/webawesome/dist/components/dialog/dialog.js';
import '@awesome.me/webawesome/dist/components/tree/tree.js';
import '@awesome.me/webawesome/dist/components/tree-item/tree-item.js';
import {$} from './dom.js';

const ICONS = {Box, FileCode, FolderOpen, Keyboard, ListVideo, Maximize, Move3d, MoveHorizontal, PanelBottom, PanelLeft, PanelRight, Pause, Play, Rotate3d, RotateCcw, Ruler, Square, StepForward, SunMoon, Undo2, X, ZoomIn, ZoomOut};
const PANELS = ['tree', 'inspector', 'bottom'];

// What a user chose stays for the next visit; a browser may refuse to keep it.
const keep = (key, value) => { try { localStorage.setItem(`takt.${key}`, value); } catch { /* not kept */ } };
const kept = (key) => { try { return localStorage.getItem(`takt.${key}`); } catch { return null; } };

// themed(dark): called at once and at each change.
export function frame(themed) {
  for (const place of document.querySelectorAll('[data-icon]')) place.append(createElement(ICONS[place.dataset.icon], {'aria-hidden': 'true'}));
  const system = matchMedia('(prefers-color-scheme: dark)');
  const dark = () => (kept('theme') ? kept('theme') === 'dark' : system.matches);
  const dress = () => {
    document.documentElement.classList.toggle('wa-dark', dark());
    document.documentElement.classList.toggle('wa-light', !dark());
    themed(dark());
  };
  system.addEventListener('change', dress);
  $('theme').onclick = () => { keep('theme', dark() ? 'light' : 'dark'); dress(); };
  dress();
  // Narrow screens begin with the cell alone; low ones without curves.
  const narrow = innerWidth <= 820, room = {tree: innerWidth >= 1200, inspector: !narrow, bottom: !narrow};
  for (const panel of PANELS) {
    const fold = (folded) => {
      document.body.classList.toggle(`no-${panel}`, folded);
      $(`fold-${panel}`).setAttribute('aria-pressed', String(!folded));
      $(`fold-${panel}`).setAttribute('aria-expanded', String(!folded));
    };
    fold(!narrow && kept(panel) ? kept(panel) === 'folded' : !room[panel]);
    $(`fold-${panel}`).onclick = () => {
      const folded = !document.body.classList.contains(`no-${panel}`);
      fold(folded);
      if (narrow && !folded) for (const other of ['tree', 'inspector']) if (other !== panel && panel !== 'bottom') $(`fold-${other}`).getAttribute('aria-expanded') === 'true' && $(`fold-${other}`).click();
      if (!narrow) keep(panel, folded ? 'folded' : 'open');
    };
  }
}

// keys: [key or keys, sentence, action(event), when(event)]; a press of a key does what its button does, except while one types.
const SHOWN = {' ': 'space', ArrowLeft: '←', ArrowRight: '→', ArrowUp: '↑', ArrowDown: '↓', PageUp: 'page up', PageDown: 'page down'};
export function keyboard(keys) {
  const rows = keys.map(([key, sentence]) => {
    const row = document.createElement('tr'), name = document.createElement('td'), what = document.createElement('td');
    for (const one of [key].flat()) {
      const shown = document.createElement('kbd');
      shown.textContent = SHOWN[one] ?? one;
      name.append(shown, ' ');
    }
    what.textContent = sentence;
    row.append(name, what);
    return row;
  });
  $('keys').querySelector('tbody').replaceChildren(...rows);
  $('help').onclick = () => { $('keys').open = true; };
  addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || $('keys').open || $('cell-menu').open) return;
    const at = event.target;
    if (at.matches?.('select, textarea, input:not([type=checkbox]):not([type=range]), [contenteditable=true]') || at.closest?.('.cm-editor')) return;
    if (event.key === ' ' && at.matches?.('button, input, summary, wa-tree-item')) return;  // the space bar presses what has the focus
    const pressed = event.key === '=' ? '+' : event.key;  // one key on many keyboards
    const found = keys.find(([key, , , when]) => [key].flat().includes(pressed) && (!when || when(event)));
    if (!found) return;
    event.preventDefault();
    found[2](event);
  });
}
