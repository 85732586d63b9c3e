// What one does on the page, by mouse and by key: robots are jogged, grippers commanded, a Part is moved while the cell stands,
// scenarios, snapshots and logs come from the menu. The state on DDS is the witness.
import {strict as assert} from 'node:assert';
import {cpSync, mkdirSync, readFileSync} from 'node:fs';
import {findings} from './axe.mjs';
import {chromium, executable, visit} from './browser.mjs';
import {patient, program, sources, start, stop, takt, view} from './processes.mjs';

const browser = await chromium.launch(executable());
cpSync(`${sources}/config`, 'config', {recursive: true});
const running = await start('takt-server', ['config/scenarios/block_assembly.yaml', '--cell', process.env.TAKT_CELL, '--snapshots', 'snapshots', '--recordings', 'recordings', '--scenarios', 'config/scenarios', '--edit']);
const {child: bridge, url} = await view();
const first = await visit(browser, url, {width: 1400, height: 900});
const {page, until, ask} = first;
const begun = Date.now();
const stage = (what) => console.log(`${((Date.now() - begun) / 1000).toFixed(1)} s: ${what}`);
const shot = (name) => process.env.TAKT_SCREENSHOT && page.screenshot({path: process.env.TAKT_SCREENSHOT.replace('.png', `_${name}.png`)});
const names = await ask(() => takt.last.description.robots[0].joints.map(({name}) => name));
const joints = () => { const of = takt('state').robots.Robot1.position; return names.map((name) => of[name]); };
const position = (name) => { const {x, y, z} = takt('state').components[name].position; return [x, y, z]; };
const near = async (read, wanted, tolerance, what) => {
  for (let i = 0; ; ++i) {
    const found = read();
    if (found.every((value, k) => Math.abs(value - wanted[k]) < tolerance)) return;
    assert.ok(i < 600, `${what}: ${found} instead of ${wanted}`);
    await new Promise((done) => setTimeout(done, 100));
  }
};
const jog = (label) => page.locator(`#selection button[aria-label="${label}"]`);
// Until the page has the scenario that this loads.
const reloaded = async (done) => {
  const generation = await ask(() => takt.last.description.scenario_generation);
  await done();
  await until((before) => takt.last.description.scenario_generation > before, generation);
};
const enabled = (label) => until((wanted) => document.querySelector(`#selection button[aria-label="${wanted}"]`)?.disabled === false, label);

stage('joints');
await ask(() => takt.select({kind: 'robot', name: 'Robot1'}));
await page.click('#pause');
await until((label) => document.querySelector(`#selection button[aria-label="${label}"]`).title === 'Run the cell first.', `${names[0]} forth`);
await page.click('#play');
await enabled(`${names[0]} forth`);
const start0 = joints();
// The sender that commands a robot is in the status while the robot moves: noted as it comes, however seldom the page draws.
await ask(() => {
  const {on} = takt.link, take = on.sample;
  window.senders = new Set();
  on.sample = (topic, sample, ...rest) => { for (const {sender} of sample.owners ?? []) window.senders.add(sender); take(topic, sample, ...rest); };
});
await jog(`${names[0]} forth`).click();
await near(joints, start0.map((q, i) => q + (i === 0 ? 5 * Math.PI / 180 : 0)), 1e-4, 'a step of 5 degrees by mouse');
// The next step goes from where the page shows the robot: on a busy machine it is there later than on DDS.
await until(([label, wanted]) => Math.abs(document.querySelector(`#selection input[aria-label="${label}"]`).value - wanted) < 0.0051, [`${names[0]} in degrees`, start0[0] * 180 / Math.PI + 5]);
await until(() => [...window.senders].some((sender) => sender.startsWith('pendant-')));
assert.ok((await page.locator('#selection table').first().textContent()).includes('commanded by'));
await page.selectOption('#selection select[aria-label="step of a turning joint"]', '1');
await jog(`${names[0]} back`).press('Enter');
await near(joints, start0.map((q, i) => q + (i === 0 ? 4 * Math.PI / 180 : 0)), 1e-4, 'a step of 1 degree by key');
const typed = page.locator(`#selection input[aria-label="${names[0]} in degrees"]`);
await typed.fill((start0[0] * 180 / Math.PI).toFixed(6));
await typed.press('Enter');
await near(joints, start0, 1e-4, 'an angle typed');
await shot('jog');

assert.deepEqual(await findings(page), [], 'axe-core');

stage('tool centre point');
const palm = await ask(() => takt.last.description.components[takt.last.description.grippers[0].palm].name);
const before = position(palm);
await jog('z+: along z').click();
await near(() => position(palm), [before[0], before[1], before[2] + 0.01], 1e-5, '10 mm up on a straight line');
await page.selectOption('#selection select[aria-label="axes of"]', 'base');
await jog('z−: along z').press('Space');
await near(() => position(palm), before, 1e-5, '10 mm down by key');
// While it is held down it goes on, and it ends with the button. A button that is busy with its last step takes no other.
await until(() => document.querySelector('#selection button[aria-label="z+: along z"]').ariaBusy !== 'true');
await page.selectOption('#selection select[aria-label="step"]', '1');
const box = await jog('z+: along z').boundingBox();
await page.mouse.move(box.x + 5, box.y + 5);
await page.mouse.down();
await near(() => [Math.min(position(palm)[2] - before[2], 0.0025)], [0.0025], 1e-4, 'more steps than one');
await page.mouse.up();
await jog('rz+: turn about z').press('Enter').catch(() => {});

stage('gripper');
await ask(() => takt.select({kind: 'gripper', name: 'Gripper1'}));
const command = (text) => page.locator('#selection button', {hasText: new RegExp(`^${text}$`)});
await until(() => [...document.querySelectorAll('#selection button')].some(({textContent, disabled}) => textContent === 'close' && !disabled));
await command('close').click();
await until(() => takt.last.state.grippers[0].closed);
assert.equal(takt('state').grippers.Gripper1.closed, true);
await command('open').press('Enter');
await until(() => !takt.last.state.grippers[0].closed);
await page.locator('#selection input[aria-label="width in mm"]').fill('30');
await command('move').click();
await until(() => Math.abs(takt.last.state.grippers[0].width - 0.03) < 2e-4);

stage('a controller has the robot');
// The pendant leaves it alone and says whose it is.
const controller = await start('takt-controller', [program, ...patient]);
await ask(() => takt.select({kind: 'robot', name: 'Robot1'}));
await until((label) => document.querySelector(`#selection button[aria-label="${label}"]`).title.startsWith('It is commanded by takt-controller'), `${names[0]} forth`);
const refused = await ask((robot) => takt.link.call('stop_jogging', {robot}), 'Robot1');
assert.match(refused.message, /commanded by takt-controller/);
await stop(controller);
await enabled(`${names[0]} forth`);

stage('moving a Part');
await page.click('#reset');
await page.click('#pause');
await until(() => takt.last.status.state !== 1);
await ask(() => takt.select({kind: 'component', name: 'C'}));
const place = position('C');
await page.locator('#cell').focus();
await page.keyboard.press('g');
await until(() => takt.mover.handles.object?.name === 'C');
await page.keyboard.press('ArrowRight');
await near(() => position('C'), [place[0] + 0.001, place[1], place[2]], 1e-9, '1 mm by key');
await page.keyboard.press('Shift+PageUp');
await near(() => position('C'), [place[0] + 0.001, place[1], place[2] + 0.01], 1e-9, '10 mm by key');
await shot('move');
// The handle of z by mouse: the place where the pointer finds it is sought above the Part.
const at = await ask(() => {
  const {camera, canvas} = takt.cell, mesh = takt.mover.handles.object, rect = canvas.getBoundingClientRect();
  const {x, y} = mesh.position.clone().project(camera);
  return [rect.left + (x + 1) / 2 * rect.width, rect.top + (1 - y) / 2 * rect.height];
});
let found = false;
for (let up = 20; up < 160 && !found; up += 4) {
  await page.mouse.move(at[0], at[1] - up);
  found = await ask(() => takt.mover.handles.axis === 'Z');
  if (found) {
    await page.mouse.down();
    await page.mouse.move(at[0], at[1] - up - 40, {steps: 4});
    await page.mouse.up();
  }
}
assert.ok(found, 'the handle of z was not found');
await until((z) => takt.last.state.components[takt.last.description.components.findIndex(({name}) => name === 'C')].position.z > z + 0.015, place[2]);
const lifted = position('C');
assert.ok(lifted[2] > place[2] + 0.015 && Math.abs(lifted[0] - place[0] - 0.001) < 1e-9 && Math.abs(lifted[1] - place[1]) < 1e-9, String(lifted));
await page.click('#turn');
await until(() => takt.mover.mode === 'rotate');
await page.locator('#cell').focus();
await page.keyboard.press('PageUp');
await near(() => [takt('state').components.C.orientation.z], [Math.sin(Math.PI / 360)], 1e-3, 'a turn of 1 degree');
await page.click('#play');
await until(() => !takt.mover.handles.object);  // no handles while it runs
await page.click('#turn');

stage('menu');
await page.locator('#cell').focus();
await page.keyboard.press('n');
await until(() => document.querySelector('#cell-menu').open && !document.querySelector('#save').disabled);
assert.equal(await page.locator('#scenario-now').textContent(), 'block_assembly');
await page.fill('#snapshot-name', 'by_hand');
await page.click('#save');
await until(() => [...document.querySelectorAll('#snapshot-files button')].some(({textContent}) => textContent === 'by_hand'));
const saved = await ask(() => takt.last.state.time);
await until((time) => takt.last.state.time > time + 0.5, saved);
const epoch = takt('state').epoch;
await page.locator('#snapshot-files button', {hasText: 'by_hand'}).press('Enter');
await until((before) => takt.last.state.epoch > before, epoch);
await page.fill('#recording-name', 'by_hand');
await page.locator('#recording-name').press('Enter');
await until(() => /by_hand/.test(document.querySelector('#menu-answer').textContent));
await page.click('#record-stop');
await until(() => /record/i.test(document.querySelector('#menu-answer').textContent));
await shot('menu');
assert.deepEqual(await findings(page), [], 'axe-core, menu');
await page.fill('#scenario-file', 'gear_on_shaft.yaml');
await page.click('#load');
await until(() => takt.last.description.scenario === 'gear_on_shaft' && takt.last.status.state === 0);
assert.equal(takt('status').state, 'stopped');
await reloaded(() => page.click('#reload'));
await until(() => document.querySelector('#scenario-now').textContent === 'gear_on_shaft');
// A Part of a mesh file: the folder offers its files, and the Part comes to where the camera looks.
mkdirSync('config/scenarios/parts');
cpSync('config/meshes/C.obj', 'config/scenarios/parts/C.obj');
await page.fill('#part-file', 'parts');
await page.locator('#part-file').press('Tab');
await until(() => [...document.querySelectorAll('#part-files option')].some(({value}) => value.endsWith('/C.obj')));
const file = await ask(() => [...document.querySelectorAll('#part-files option')].find(({value}) => value.endsWith('/C.obj')).value);
await page.fill('#part-file', file);
await page.locator('#part-name').press('Enter');
await until(() => /mass/.test(document.querySelector('#menu-answer').textContent));
const many = await ask(() => takt.last.description.components.length);
await page.fill('#part-mass', '0.25');
await page.locator('#part-mass').press('Enter');
await until((count) => takt.last.description.components.length === count + 1, many);
await until(() => takt.selected()?.name === 'C');
const looked = await ask(() => takt.cell.orbit.target.toArray());
await near(() => position('C'), looked, 1e-9, 'a Part of a mesh file');
await page.click('#reload');
await until((count) => takt.last.description.components.length === count, many);
// What is not there is said, and the cell stays.
await page.fill('#scenario-file', 'nothing.yaml');
await page.locator('#scenario-file').press('Enter');
await until(() => /nothing\.yaml/.test(document.querySelector('#menu-answer').textContent));
assert.equal(await ask(() => takt.last.description.scenario), 'gear_on_shaft');
await page.keyboard.press('Escape');
await until(() => !document.querySelector('#cell-menu').open);

stage('editor');
await page.locator('#cell').focus();
await page.keyboard.press('y');
await page.locator('#editor .cm-content').waitFor();
await until(() => document.querySelector('#editor .cm-content').textContent.includes('gear_on_shaft'));
// A wrong value is marked at its line, by the reader of the server; the file stays.
const editor = page.locator('#editor .cm-content');
await editor.press('Control+Home');
await page.keyboard.type('takt_scenarios: 1\n');
await until(() => /^line 1: .*takt_scenarios/.test(document.querySelector('#editor-answer').textContent));
await page.locator('#editor .cm-lintRange-error').first().waitFor();
await shot('editor');
await page.click('#editor-save');
await until(() => document.querySelector('#editor-answer').className === 'fault');
// A narrow screen gives the sentence a line of its own.
await page.setViewportSize({width: 390, height: 844});
await until(() => document.querySelector('#editor-answer').clientWidth > 300);
await page.setViewportSize({width: 1400, height: 900});
assert.ok(!readFileSync('config/scenarios/gear_on_shaft.yaml', 'utf8').includes('takt_scenarios'));
await editor.press('Control+Home');
await page.keyboard.press('Control+Delete');
await page.keyboard.press('Shift+End');
await page.keyboard.press('Delete');
await page.keyboard.press('Delete');
// Keys are completed, and the new text is loaded.
await editor.press('Control+End');
await page.keyboard.type('\ncsv_pe');
await page.locator('.cm-tooltip-autocomplete li', {hasText: 'csv_period_s'}).click();
await until(() => document.querySelector('#editor .cm-content').textContent.includes('csv_period_s: '));
await page.keyboard.type('0.02');
await until(() => document.querySelector('#editor-answer').textContent === 'valid');
await reloaded(() => page.keyboard.press('Control+Enter'));
assert.match(readFileSync('config/scenarios/gear_on_shaft.yaml', 'utf8'), /csv_period_s: 0\.02/);
await page.click('#editor-close');
assert.ok(await page.locator('#editor').isHidden());
const foreign = await ask(() => takt.link.call('save_scenario_text', {text: 'takt_scenario: 1\nname: x\nparts:\n  A: {mesh: /etc/passwd, mass_kg: 1, hierarchy: 1}\n', only_check: true}));
assert.match(foreign.message, /etc.passwd.*directory of scenarios/);

stage('observer');
const observer = await visit(browser, `${url}?observer`, {width: 1400, height: 900});
await observer.page.click('#menu');
await observer.until(() => /Observers/.test(document.querySelector('#menu-answer').textContent));
assert.ok(await observer.page.locator('#load').isDisabled());
assert.deepEqual(observer.problems, []);

assert.deepEqual(first.problems, []);
await browser.close();
await stop(bridge);
await stop(running);
console.log('jogged, commanded, moved, saved, recorded and loaded, by mouse and by key');
process.exit(0);
