// The site of the documentation, opened as a file as a reader does: its search finds pages, and each reader's page is within two
// clicks of the start. No program of takt runs.
import {strict as assert} from 'node:assert';
import {execFileSync} from 'node:child_process';
import {pathToFileURL} from 'node:url';
import {chromium, executable} from './browser.mjs';

const browser = await chromium.launch(executable());
const place = `${process.env.TAKT_WORK}/site`;
try {
  execFileSync('python3', ['-B', `${process.env.TAKT_SOURCES}/docs/site/build.py`, place], {encoding: 'utf8', stdio: 'pipe'});
} catch ({stderr}) {
  if (!/No such file or directory: '(mkdocs|doxygen)'|libjs-katex/.test(stderr)) throw new Error(stderr);
  console.log('skipped: the site cannot be built (Debian packages mkdocs, mkdocs-material, doxygen, libjs-katex)');
  process.exit(77);
}
const start = pathToFileURL(`${place}/site/index.html`).href;
const page = await (await browser.newContext({viewport: {width: 1400, height: 900}})).newPage();
const problems = [];
page.on('pageerror', (error) => problems.push(error.stack));
await page.goto(start);

// Words that are typed before the search is ready are searched for, too.
const hasty = await page.context().newPage();
hasty.on('pageerror', (error) => problems.push(error.stack));
await hasty.addInitScript(() => document.addEventListener('DOMContentLoaded', () => {
  const field = document.querySelector('.md-search__input');
  field.focus();
  field.value = 'MoveIt';
  field.dispatchEvent(new KeyboardEvent('keyup', {key: 't'}));
}));
await hasty.goto(start);
await hasty.locator('.md-search-result__link').first().waitFor();
await hasty.close();

// By key: the field, the words, the first of the results.
await page.keyboard.press('s');
await page.waitForFunction(() => document.activeElement.matches('.md-search__input'));
await page.keyboard.type('MoveIt');
const found = page.locator('.md-search-result__link').first();
await found.waitFor();
await page.waitForFunction(() => /^\d+ matching documents/.test(document.querySelector('.md-search-result__meta').textContent.trim()));
await found.click();
await page.waitForURL(/\.html/);
assert.match(await page.locator('article').textContent(), /MoveIt/);

// What a reader has, and the page for it: each link of the start leads there, or to a page with a link to it.
const readers = {'a UR or Franka URDF': 'cells', 'a PLC': 'tutorials/plc', 'ROS 2': 'tutorials/ros2', 'a UR driver': 'tutorials/ur_driver', 'Python': 'tutorials/python', 'C++': 'tutorials/cpp', 'KUKA or ABB': 'controllers_rsi_egm', 'CAD': 'tutorials/cad', 'CI': 'tutorials/ci'};
const linked = async (from) => { await page.goto(from); return page.locator('article a[href]').evaluateAll((links) => links.map(({href}) => href.replace(/#.*/, ''))); };
const first = await linked(start), second = await linked(start.replace('index.html', 'get_started.html'));
for (const [what, name] of Object.entries(readers)) {
  const wanted = start.replace('index.html', `${name}.html`);
  assert.ok(first.includes(wanted) || (first.includes(start.replace('index.html', 'get_started.html')) && second.includes(wanted)), `${what}: ${name} is not within two clicks`);
}
// No table is cut off at the width of an ordinary screen.
for (const name of ['comparison', 'events', 'glossary', 'view']) {
  await page.goto(start.replace('index.html', `${name}.html`));
  const cut = await page.locator('.md-typeset__scrollwrap').evaluateAll((wraps) => wraps.filter(({scrollWidth, clientWidth}) => scrollWidth > clientWidth + 1).length);
  assert.equal(cut, 0, `${name} has tables that are cut off`);
}
assert.deepEqual(problems, []);
await browser.close();
console.log('the search of the site works in files; pages of nine readers are within two clicks');
process.exit(0);
