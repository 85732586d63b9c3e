// The picture of takt view in Debian's Chromium: screenshots, section, following a part, and the link to a view.
import {strict as assert} from 'node:assert';
import {readFileSync, writeFileSync} from 'node:fs';
import {ALL_PIXELS, chromium, executable, visit} from './browser.mjs';
import {server, start, stop, takt, view} from './processes.mjs';

const browser = await chromium.launch(executable());
const begun = Date.now();
const stage = (what) => console.log(`${((Date.now() - begun) / 1000).toFixed(1)} s: ${what}`);

stage('a cell in which Gripper1 carries P');
const running = await server('--paused');
const {child: bridge, url} = await view();
const wide = {width: 1600, height: 500};  // what the page says must not make its head a line higher, and the canvas smaller
const {page, problems, until, ask, pixels} = await visit(browser, url, wide, {deviceScaleFactor: ALL_PIXELS});
await page.click('#fold-bottom');  // in this low window the curves leave the picture little room
const distance = (a, b) => Math.hypot(...a.map((value, i) => value - b[i]));
const placeOfP = () => Object.values(takt('state').components.P.position);
// Robot1 carries out a program to its end and holds still; the page shows where the cell stands then. How far P has moved.
async function go(lines) {
  writeFileSync('go.lua', `
local LIFT = {speed_m_per_s = 0.25, acceleration_m_per_s2 = 1.0}
local grip = pose{x = -0.22, y = 0.20, z = 0.7} * pose{z = 0.054, roll = math.pi}
routine("Robot1", function(r)
  ${lines}
end)
`);
  const from = placeOfP();
  const controller = await start('takt-controller', ['go.lua', '--start', '--timeout', '600']);
  assert.equal(await controller.ended, 0, controller.text);
  await page.click('#pause');
  await until(() => takt.last.status.state === 2);
  const {step} = takt('state');
  await until((shown) => takt.last.state.step === BigInt(shown), step);
  return distance(from, placeOfP());
}
await go(`r.gripper:width(0.06)
  r:move_to(grip:offset(0, 0, 0.12), {speed = 0.5, acceleration_rad_per_s2 = 2})
  r:move_line(grip, LIFT)
  r.gripper:close()
  r:wait(0.4)
  r:move_line(grip:offset(0, 0, 0.15), LIFT)`);
const carryTo = (x) => go(`r:move_line(grip:offset(${x}, 0, 0.15), LIFT)`);
await until(() => document.querySelector('#graph').textContent.includes('Gripper1'));

stage('screenshot');
// A PNG of the canvas in its own size, with more than one colour, as what the page shows.
const screenshot = async () => {
  const [download] = await Promise.all([page.waitForEvent('download'), page.click('#screenshot')]);
  assert.match(download.suggestedFilename(), /^takt_\d+\.\d{3}s\.png$/);
  return readFileSync(await download.path());
};
const png = await screenshot();
assert.equal(png.subarray(0, 8).toString('latin1'), '\x89PNG\r\n\x1a\n');
const canvas = await ask(() => { const {width, height} = document.querySelector('#cell'); return {width, height}; });
assert.deepEqual({width: png.readUInt32BE(16), height: png.readUInt32BE(20)}, canvas);
// How often each colour is in a picture; and how many pixels of two pictures differ by more than a tolerance.
const differing = (one, other, tolerance = 0) => ask(async ([files, most]) => {
  const data = await Promise.all(files.map(async (base64) => {
    const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
    const context = new OffscreenCanvas(image.width, image.height).getContext('2d');
    context.drawImage(image, 0, 0);
    return context.getImageData(0, 0, image.width, image.height).data;
  }));
  const colours = new Map();
  let count = 0;
  for (let i = 0; i < data[0].length; i += 4) {
    const colour = data[0].slice(i, i + 3).join();
    colours.set(colour, (colours.get(colour) ?? 0) + 1);
    if ([0, 1, 2].some((k) => Math.abs(data[0][i + k] - data[1][i + k]) > most)) ++count;
  }
  return {part: count / (data[0].length / 4), colours: colours.size, largest: Math.max(...colours.values()) / (data[0].length / 4), same: data[0].length === data[1].length};
}, [[one, other], tolerance]);
// The samples of the instant come one by one: the picture may change between the file and the look at the canvas.
let whole, saved;
for (let attempt = 0; attempt < 20 && saved?.part !== 0; ++attempt) {
  const file = (await screenshot()).toString('base64');
  whole = await pixels();
  saved = await differing(file, whole);
}
assert.ok(saved.same && saved.part === 0, `the file is what the canvas has: ${JSON.stringify(saved)}`);
assert.ok(saved.colours > 100 && saved.largest < 0.95, `not blank: ${JSON.stringify(saved)}`);

stage('section');
// It takes away what lies behind it, and nothing else: all of the cell at one end of its range, nothing at the other.
assert.ok(await page.locator('#cut').isHidden());
await page.selectOption('#section', 'x');
const cut = async (at) => {
  await page.locator('#cut').evaluate((slider, value) => { slider.value = value; slider.dispatchEvent(new Event('input')); }, at);
  await until((value) => takt.cell.cut === value, at);
  return pixels();
};
const half = await cut(0), uncut = await cut(2), away = await cut(-2);
assert.ok((await differing(half, whole)).part > 0.01);
// Where the processor draws, a section has the backs of solids too: pixels at outlines differ.
assert.ok((await differing(uncut, whole)).part < 0.006);
assert.ok((await differing(away, half)).part > 0.01);
await page.selectOption('#section', '');
assert.equal((await differing(await pixels(), whole)).part, 0);

stage('follow');
// A followed component stays at its place in the picture while the cell goes on; all others move through it.
const onScreen = () => ask(() => {
  takt.cell.camera.updateMatrixWorld();
  const {x, y} = takt.cell.components.find(({mesh}) => mesh.name === 'P').mesh.position.clone().project(takt.cell.camera);
  return [x, y];
});
const seen = async () => ({at: await onScreen(), picture: await pixels(), camera: await ask(() => takt.cell.view().camera)});
const first = await seen();
assert.ok(await carryTo(0.1) > 0.09);
const free = await seen();
await page.selectOption('#follow', 'P');
assert.ok(await carryTo(0.2) > 0.09);
const followed = await seen();
await page.selectOption('#follow', '');
assert.deepEqual(free.camera, first.camera);
assert.ok(distance(free.at, first.at) > 0.01, `P moves through the picture: ${first.at}, ${free.at}`);
assert.ok(distance(followed.at, free.at) < 1e-9, `P stays in the picture: ${free.at}, ${followed.at}`);
assert.ok(distance(followed.camera, free.camera) > 0.04);
// With the camera the whole picture moves: the tables too, and more of it differs than where only an arm has moved.
const [still, moved] = [await differing(free.picture, first.picture), await differing(followed.picture, free.picture)];
assert.ok(still.part > 0.002 && moved.part > still.part, `${still.part}, ${moved.part}`);

stage('link');
await page.click('#fold-bottom');
// The address has camera, section, what is followed and the plots; a page opened with it shows the same picture.
await page.mouse.move(300, 300);
await page.mouse.down();
await page.mouse.move(420, 340, {steps: 5});
await page.mouse.up();
await page.selectOption('#section', 'y');
await cut(0.1);
await page.uncheck('#holding');
await page.fill('#signal', 'state.components.C.position.x');
await page.click('#add-plot');
await page.locator('.plot .close').first().click();  // one of the first plots is not wanted
await until(() => takt.plots.plots.length === 2);
await page.click('#link');
await until(() => /address/.test(document.querySelector('#answer').textContent));
assert.notDeepEqual(await ask(() => takt.cell.view().camera), followed.camera);
const visitor = await visit(browser, page.url(), wide, {deviceScaleFactor: ALL_PIXELS});
await visitor.until(() => takt.plots.plots.length === 2);
// As JSON: -0 is 0 in an address, and the same place.
const looks = async (who) => JSON.parse(JSON.stringify(await who.ask(() => ({view: takt.cell.view(), section: document.querySelector('#section').value, cut: Number(document.querySelector('#cut').value),
  holding: document.querySelector('#holding').checked, plots: takt.plots.names()}))));
assert.deepEqual(await looks(visitor), await looks({ask}));
assert.equal((await looks(visitor)).plots[1], 'state.components.C.position.x');
assert.ok(!(await visitor.page.locator('#cut').isHidden()));
// A camera is kept to a millimetre, so light falls a little different, and edges on other pixels, as do the grid's thin lines:
// the pictures are compared without it.
for (const who of [ask, visitor.ask]) await who(() => { takt.cell.grid.visible = false; takt.cell.dirty = true; });
const same = await differing(await pixels(), await visitor.pixels(), 8);
assert.ok(same.same, 'pictures of one size');
assert.ok(same.part < 0.01, `${same.part} of the pixels differ`);
assert.deepEqual([...problems, ...visitor.problems], []);
await browser.close();
await stop(running);
await stop(bridge);
console.log(`screenshot, section, following and link; of the link's picture ${(100 * same.part).toFixed(2)} % differ`);
process.exit(0);
