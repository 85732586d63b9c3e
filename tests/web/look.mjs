// The look of the page: its first picture of several cells has all of the cell, in three sizes, light and dark; a selection
// is the same in tree, picture and inspector, by mouse and by key; requests of the inspector are in the state on DDS.
// TAKT_SCREENSHOT=FOLDER/NAME.png keeps the pictures as FOLDER/CELL_WIDTH_THEME.png (gallery.py), TAKT_LOOK_CELL=FILE,FOLDER looks at that
// cell too, whose robots have their mesh files in the folder.
import {strict as assert} from 'node:assert';
import {basename, dirname} from 'node:path';
import {findings} from './axe.mjs';
import {chromium, executable, visit} from './browser.mjs';
import {server, start, stop, takt, view} from './processes.mjs';

const browser = await chromium.launch(executable());
const SIZES = [[1400, 900], [2560, 1440], [390, 844]];
const running = await server('--paused');
const {child: bridge, url} = await view();
const begun = Date.now();
const stage = (what) => console.log(`${((Date.now() - begun) / 1000).toFixed(1)} s: ${what}`);
const first = await visit(browser, url, {width: 1400, height: 900});
const {page, until, ask} = first;

stage('selection');
await page.click('wa-tree-item[data-name="P"]');
await until(() => takt.selected()?.name === 'P');
assert.equal(await page.locator('#selection h2').textContent(), 'P');
assert.equal(await ask(() => takt.cell.chosen.name), 'P');
// The key takes it away, and a click in the picture brings one back.
await page.locator('#cell').focus();
await page.keyboard.press('Escape');
assert.equal(await ask(() => takt.selected()), null);
await page.keyboard.press('4');
await until(() => takt.eye.flight === null && Math.abs(takt.cell.camera.position.x - takt.cell.orbit.target.x) < 0.01);
const placeOf = (name) => ask((wanted) => {
  const {camera, canvas, components} = takt.cell, {mesh} = components.find((one) => one.mesh.name === wanted);
  mesh.geometry.computeBoundingSphere();
  camera.updateMatrixWorld();
  const {x, y} = mesh.geometry.boundingSphere.center.clone().applyMatrix4(mesh.matrixWorld).project(camera), box = canvas.getBoundingClientRect();
  return [box.left + (x + 1) / 2 * box.width, box.top + (1 - y) / 2 * box.height];
}, name);
await page.mouse.click(...await placeOf('P'));
await until(() => takt.selected() !== null);
const hit = await ask(() => takt.selected().name);
assert.equal(await page.locator('#selection h2').textContent(), hit);
assert.equal(await page.locator('wa-tree-item[selected]').last().getAttribute('data-name'), hit);
await page.keyboard.press('z');
await until(() => takt.eye.flight === null);
// A jaw is its gripper: in the picture, in the tree and in the inspector.
await page.locator('#cell').focus();
await page.keyboard.press('3');
await until(() => takt.eye.flight === null);
const jaw = await ask(() => { const {grippers: [{left_jaw: left}], components} = takt.last.description; return components[left].name; });
await page.mouse.click(...await placeOf(jaw));
await until(() => takt.selected()?.kind === 'gripper');
const grip = await ask(() => takt.selected().name);
assert.equal(await page.locator('#selection h2').textContent(), grip);
assert.equal(await page.locator('wa-tree-item[selected]').last().getAttribute('data-name'), grip);

stage('the view by key');
// Around the target at the same distance, nearer, beside, and back.
await page.locator('#cell').focus();
await page.keyboard.press('1');
await until(() => takt.eye.flight === null);
const seenFrom = () => ask(() => { const {camera: {position}, orbit: {target}} = takt.cell; return {at: position.toArray(), to: target.toArray(), far: position.distanceTo(target), high: position.z - target.z}; });
const begin = await seenFrom();
await page.keyboard.press('ArrowRight');
const turned = await seenFrom();
assert.ok(Math.abs(turned.far - begin.far) < 1e-6 && Math.abs(turned.high - begin.high) < 1e-6 && Math.hypot(turned.at[0] - begin.at[0], turned.at[1] - begin.at[1]) > 0.01, JSON.stringify([begin, turned]));
await page.keyboard.press('ArrowUp');
assert.ok((await seenFrom()).high > turned.high + 0.01);
await page.keyboard.press('+');
assert.ok(Math.abs((await seenFrom()).far / begin.far - 0.8) < 1e-6);
await page.keyboard.press('Shift+ArrowLeft');
const beside = await seenFrom();
assert.ok(Math.hypot(...beside.to.map((value, i) => value - begin.to[i])) > 0.01);
await page.keyboard.press('z');
await until(() => takt.eye.flight === null);
assert.ok(Math.hypot(...(await seenFrom()).to.map((value, i) => value - begin.to[i])) < 1e-6);
// A length by key: the surface in the middle of the picture, twice, with a step to the side between; by mouse the same two.
const length = () => page.locator('#answer').textContent().then((text) => Number(text.match(/^([\d.]+) mm/)?.[1]));
await page.keyboard.press('4');
await until(() => takt.eye.flight === null);
await page.keyboard.press('f');
await until(() => takt.eye.flight === null);
await page.keyboard.press('m');
assert.ok(await page.locator('#aim').isVisible());
await page.keyboard.press('Enter');
await page.keyboard.press('Shift+ArrowRight');
await page.keyboard.press('Enter');
const measured = await length();
assert.ok(measured > 1, await page.locator('#answer').textContent());
const centre = await page.locator('#cell').boundingBox().then(({x, y, width, height}) => [x + width / 2, y + height / 2]);
await page.mouse.click(...centre);
await page.locator('#cell').focus();
await page.keyboard.press('Shift+ArrowLeft');
await page.mouse.click(...centre);
assert.ok(Math.abs(await length() - measured) < 0.02 * measured, `${await length()} mm by mouse, ${measured} mm by key`);
await page.keyboard.press('m');
assert.ok(await page.locator('#aim').isHidden());
await page.keyboard.press('Escape');

stage('quality');
// Pictures that follow each other are drafts where full ones are slow, and the last one is in full again, pixel for pixel; where
// they are fast there is no draft. The same on a canvas that is multisampled itself, as with a graphics card.
const sampling = (made) => made.addInitScript(() => {
  const get = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, attributes) { return get.call(this, kind, kind === 'webgl2' ? {...attributes, antialias: true} : attributes); };
});
const sampled = await visit(browser, url, {width: 900, height: 560}, {prepare: sampling});
for (const seen of [first, sampled]) {
  assert.equal(await seen.ask(() => takt.cell.quality.sampled), seen === sampled);
  await seen.until(() => takt.cell.settled);
  await seen.ask(() => {
    const {quality, canvas} = takt.cell, draw = quality.draw.bind(quality);
    quality.take = () => {};
    takt.drawn = [];
    quality.draw = (scene, camera, full) => { takt.drawn.push(full); draw(scene, camera, full); if (!full) takt.draft = canvas.toDataURL('image/png').split(',')[1]; };
  });
  const whole = await seen.pixels();
  for (const slow of [false, true]) {
    await seen.ask((value) => {
      takt.cell.quality.slow = value;
      takt.drawn.length = 0;
      return new Promise((done) => {
        const go = () => { takt.cell.dirty = true; if (takt.drawn.length < 6) requestAnimationFrame(go); else done(); };
        go();
      });
    }, slow);
    await seen.until(() => takt.cell.settled);
    const kinds = await seen.ask(() => takt.drawn);
    assert.deepEqual(kinds.slice(1), slow ? [...kinds.slice(2).fill(false), true] : kinds.slice(1).fill(true));
    assert.equal(await seen.pixels(), whole);
  }
  // Both have a picture, the same one but for the edges in it.
  const {colours, apart} = await seen.ask(async (data) => {
    const [full, draft] = await Promise.all([data, takt.draft].map(async (one) => {
      const picture = await createImageBitmap(await (await fetch(`data:image/png;base64,${one}`)).blob()), context = new OffscreenCanvas(picture.width, picture.height).getContext('2d');
      context.drawImage(picture, 0, 0);
      return context.getImageData(0, 0, picture.width, picture.height).data;
    }));
    return {colours: [full, draft].map(({buffer}) => new Set(new Uint32Array(buffer)).size), apart: full.reduce((sum, value, i) => sum + Math.abs(value - draft[i]), 0) / full.length};
  }, whole);
  assert.ok(Math.min(...colours) > 100 && apart < 5, `${colours} colours, ${apart} of 255 apart`);
  await seen.ask(() => { delete takt.cell.quality.draw; delete takt.cell.quality.take; takt.cell.quality.slow = false; });
}
assert.deepEqual(sampled.problems, []);
await sampled.page.context().close();

stage('the address');
// A view that was turned is in it; one that fits the cell is not, so that another screen fits it too.
const inAddress = (of) => of.evaluate(() => JSON.parse(decodeURIComponent(location.hash.slice(1))));
assert.ok((await inAddress(page)).camera);
const fresh = await visit(browser, url, {width: 1400, height: 900});
await fresh.until(() => takt.plots.plots.length === 2 && location.hash.length > 1);
assert.equal((await inAddress(fresh.page)).camera, undefined);
await fresh.page.setViewportSize({width: 390, height: 844});
await fresh.page.reload();
await fresh.until(() => takt.last.description && takt.cell.grid && takt.eye.corners().every((corner) => { takt.cell.camera.updateMatrixWorld(); return Math.abs(corner.project(takt.cell.camera).x) <= 1; }));
assert.deepEqual(fresh.problems, []);
await fresh.page.context().close();

stage('requests');
// A Part is put elsewhere while the cell stands, and a gripper's signal is forced: the state on DDS has both.
await ask(() => takt.select({kind: 'component', name: 'P'}));
const x = Number(Object.values(takt('state').components.P.position)[0]) * 1000;
await page.locator('#selection input').first().fill(String((x + 5).toFixed(3)));
assert.match(await page.locator('#selection table').first().textContent(), /level of detail1/);
await page.locator('#selection button', {hasText: 'put'}).click();
await until((wanted) => Math.abs(takt.last.state.components[takt.last.description.components.findIndex(({name}) => name === 'P')].position.x * 1000 - wanted) < 0.01, x + 5);
assert.ok(Math.abs(1000 * Object.values(takt('state').components.P.position)[0] - (x + 5)) < 0.01);
await page.locator('#selection button', {hasText: 'explain'}).click();
await until(() => [...document.querySelectorAll('#selection p')].at(-1).textContent.includes('P'));
await ask(() => takt.select({kind: 'gripper', name: 'Gripper1'}));
await page.locator('#selection button', {hasText: 'force closed'}).press('Enter');
await until(() => takt.last.state.grippers[0].forced !== 0);
await page.locator('#selection button', {hasText: 'release'}).click();
await until(() => takt.last.state.grippers[0].forced === 0);

stage('observer');
const observer = await visit(browser, `${url}?observer`, {width: 1400, height: 900});
await observer.ask(() => takt.select({kind: 'component', name: 'P'}));
await observer.until(() => document.querySelector('#selection .why')?.textContent.includes('Observers'));
assert.ok(await observer.page.locator('#selection button', {hasText: 'put'}).isDisabled());
await observer.page.close();

stage('keys and folding');
await page.locator('#cell').focus();
await page.keyboard.press('.');
await until(() => takt.last.state.step >= 10n);
await page.keyboard.press('i');
assert.ok(await page.locator('#inspector').isHidden());
await page.click('#fold-inspector');
assert.ok(await page.locator('#inspector').isVisible());
await page.locator('#cell').focus();
await page.keyboard.press('?');
await until(() => document.querySelector('#keys').open);
await page.keyboard.press('Escape');
await until(() => !document.querySelector('#keys').open);
assert.deepEqual(first.problems, []);
await page.close();
await stop(bridge);
await stop(running);

stage('pictures');
// All corners of what is drawn are in the picture and none below a tool, at each size.
const cells = ['block_assembly', 'chainsaw_motor', 'bev_rotor', 'nut_on_bolt', 'gear_on_shaft'].map((name) => [`${process.env.TAKT_SOURCES}/config/scenarios/${name}.yaml`]);
if (process.env.TAKT_LOOK_CELL) cells.push(process.env.TAKT_LOOK_CELL.split(','));
for (const [file, folder] of cells) {
  const scenario = basename(file, '.yaml');
  const cell = await start('takt-server', [file, '--cell', process.env.TAKT_CELL, '--paused', ...(folder ? ['--packages', folder] : [])]);
  const {child: bridge, url} = await view(0, ...(folder ? ['--files', folder] : []));
  // Each size is opened with the first cell and in the gallery; the window of other cells comes to the last size from another one.
  const opens = scenario === 'block_assembly' || process.env.TAKT_SCREENSHOT;
  let seen = null;
  for (const [width, height] of opens ? SIZES : SIZES.toReversed()) {
    if (opens || width !== SIZES[0][0]) {
      await seen?.page.context().close();
      seen = await visit(browser, url, {width, height});
    } else await seen.page.setViewportSize({width, height});
    await seen.until((wanted) => innerWidth === wanted && takt.cell.width === takt.cell.canvas.clientWidth, width);
    // The theme changes no layout: the first cell and the gallery have both.
    for (const colorScheme of opens ? ['light', 'dark'] : ['light']) {
      await seen.page.emulateMedia({colorScheme});  // the page follows the system
      await seen.until((dark) => document.documentElement.classList.contains('wa-dark') === dark, colorScheme === 'dark');
      await seen.until((name) => takt.last.description?.scenario === name && takt.cell.radius > 0 && takt.cell.grid, scenario);
      await seen.pixels();
      // Meshes of robots come after the first picture, and the view follows them.
      await seen.until(() => {
        const {camera, canvas} = takt.cell, place = canvas.getBoundingClientRect(), tools = [...document.querySelectorAll('#camera button, #scale-bar')].map((one) => one.getBoundingClientRect());
        camera.updateMatrixWorld();
        return takt.eye.corners().every((corner) => {
          const {x, y} = corner.project(camera), [left, top] = [place.left + (x + 1) / 2 * place.width, place.top + (1 - y) / 2 * place.height];
          return Math.abs(x) <= 1 && Math.abs(y) <= 1 && !tools.some((tool) => left > tool.left && left < tool.right && top > tool.top && top < tool.bottom);
        });
      });
      await seen.until(() => document.documentElement.scrollWidth <= innerWidth);  // nothing beside the screen
      await seen.until(() => { const events = document.querySelector('#events'); return events.scrollWidth <= events.clientWidth; });  // nor a long key beside its panel
      // Nor is any of the top bar, which a narrow screen has on several lines.
      const beside = await seen.ask(() => [...document.querySelectorAll('#topbar button, #topbar input, #topbar select')].filter((one) => one.getBoundingClientRect().right > innerWidth).map(({id, ariaLabel}) => id || ariaLabel));
      assert.deepEqual(beside, [], `the top bar at ${width}`);
      if (scenario === 'block_assembly') assert.ok(await seen.ask(() => document.querySelector('#topbar').offsetHeight) <= 120, `the top bar takes three lines at most at ${width}`);
      if (scenario === 'block_assembly') assert.deepEqual(await findings(seen.page), [], `axe-core at ${width}, ${colorScheme}`);
      if (process.env.TAKT_SCREENSHOT) await seen.page.screenshot({path: `${dirname(process.env.TAKT_SCREENSHOT)}/${scenario}_${width}_${colorScheme}.png`});
    }
    // Parts that have a temperature have its colour, with a scale; a hotter one is brighter.
    if (width === SIZES[0][0]) {
      const heated = await seen.ask(() => takt.cell.heat.of.size > 0);
      assert.equal(heated, scenario === 'bev_rotor');
      assert.equal(await seen.page.locator('#by-temperature').isVisible(), heated);
      if (heated) {
        await seen.page.locator('#cell').focus();
        await seen.page.keyboard.press('k');
        await seen.until(() => document.querySelector('#heat-scale span').textContent === '20 °C to 280 °C');
        const bright = await seen.ask(() => ['Core1', 'Core3', 'Core4'].map((name) => { const {r, g, b} = takt.cell.components.find(({mesh}) => mesh.name === name).mesh.material.color; return r + g + b; }));
        assert.ok(bright[0] < bright[1] && bright[1] < bright[2], String(bright));
        await seen.ask(() => takt.select({kind: 'component', name: 'Core4'}));
        await seen.until(() => [...document.querySelectorAll('#selection tr')].some(({textContent}) => textContent === 'temperature280.0 °C'));
        assert.doesNotMatch(await seen.page.locator('#selection').innerText(), /-0\.0+\b/);
        if (process.env.TAKT_SCREENSHOT) await seen.page.screenshot({path: `${dirname(process.env.TAKT_SCREENSHOT)}/${scenario}_temperature.png`});
      }
    }
    assert.deepEqual(seen.problems, []);
  }
  await seen.page.context().close();
  await stop(bridge);
  await stop(cell);
}
await browser.close();
console.log('whole cells in three sizes and two themes; selection, requests and keys');
process.exit(0);
