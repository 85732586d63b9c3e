// A robot whose URDF names mesh files (STL beside it, OBJ and DAE by package://) in takt view: drawn where its joints put
// them, from the folders that were allowed and from nowhere else. Joints beside its chain stand where takt has them, and the
// links of its gripper are drawn as that gripper alone.
import {strict as assert} from 'node:assert';
import {mkdirSync, symlinkSync, writeFileSync} from 'node:fs';
import {chromium, executable} from './browser.mjs';
import {sources, start, stop, view} from './processes.mjs';

// A block from 0 to (x, y, z), as the corners of its 12 triangles.
function block([x, y, z]) {
  const corner = (i) => [i & 1 ? x : 0, i & 2 ? y : 0, i & 4 ? z : 0];
  return [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]]
    .map((triangle) => triangle.map(corner));
}
const size = {base: [0.3, 0.2, 0.1], arm: [0.5, 0.1, 0.08], hand: [0.05, 0.06, 0.07]};
const stl = `solid base\n${block(size.base).map((t) => `facet normal 0 0 0\nouter loop\n${t.map((c) => `vertex ${c.join(' ')}`).join('\n')}\nendloop\nendfacet`).join('\n')}\nendsolid base\n`;
const points = block(size.arm).flat();
const obj = `${points.map((c) => `v ${c.join(' ')}`).join('\n')}\n${points.map((c, i) => (i % 3 ? '' : `f ${i + 1} ${i + 2} ${i + 3}`)).filter(Boolean).join('\n')}\n`;
const hand = block(size.hand).flat();
const dae = `<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="pa" count="${3 * hand.length}">${hand.flat().join(' ')}</float_array><technique_common><accessor source="#pa" count="${hand.length}" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="12"><input semantic="VERTEX" source="#v" offset="0"/><p>${hand.map((c, i) => i).join(' ')}</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>`;
const link = (name, mesh) => `<link name="${name}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial><visual>${name === 'hand' ? '<origin xyz="0.5 0 0"/>' : ''}<geometry><mesh filename="${mesh}"/></geometry></visual></link>`;
const urdf = `<?xml version="1.0"?><robot name="drawn">${link('base_link', '../meshes/base.stl')}${link('arm', 'package://drawn_robot/meshes/arm_one.obj')}
${link('hand', 'package://drawn_robot/meshes/hand.dae')}${link('tool', 'package://elsewhere/meshes/tool.stl')}
<joint name="j1" type="revolute"><parent link="base_link"/><child link="arm"/><origin xyz="0 0 0.1"/><axis xyz="0 0 1"/><limit lower="-3.2" upper="3.2" effort="100" velocity="3"/></joint>
<joint name="j2" type="fixed"><parent link="arm"/><child link="hand"/></joint><joint name="j3" type="fixed"><parent link="hand"/><child link="tool"/></joint>
${['palm', 'left', 'right'].map((name, i) => `<link name="${name}"><visual><origin xyz="0 ${[0, 0.01, -0.01][i]} ${i ? 0.05 : 0}"/><geometry><box size="0.04 ${i ? 0.01 : 0.1} 0.05"/></geometry></visual></link>`).join('')}
<joint name="j4" type="fixed"><origin xyz="0.6 0 0"/><parent link="hand"/><child link="palm"/></joint>
${['left', 'right'].map((name, i) => `<joint name="${name}_finger" type="prismatic"><parent link="palm"/><child link="${name}"/><axis xyz="0 ${1 - 2 * i} 0"/><limit lower="0" upper="0.03" effort="10" velocity="0.1"/></joint>`).join('')}
<link name="lid"/><link name="cover"/><joint name="hinge" type="revolute"><parent link="base_link"/><child link="lid"/><axis xyz="0 1 0"/><limit lower="0.2" upper="1" effort="1" velocity="1"/></joint>
<joint name="follower" type="revolute"><parent link="lid"/><child link="cover"/><axis xyz="0 1 0"/><limit lower="0" upper="1" effort="1" velocity="1"/><mimic joint="hinge" multiplier="-2" offset="0.1"/></joint></robot>`;
const scenario = `takt_scenario: 1\nname: drawn\nduration_s: 1\nsolver: {method: rk2, step_s: 0.001}\nprocesses: {cell: {level_of_detail: 1, members: all}}
grounds:\n  Carriage: {mesh: ${sources}/config/devices/meshes/plate.obj, pose: {position_m: [1, 2, 3]}}
robots:\n  Drawn:\n    mounted_on: Carriage\n    urdf: ../drawn_robot/urdf/drawn.urdf\n    base_link: base_link\n    flange_link: hand\n    initial_joints_deg: [90]\n    pose: {position_m: [1, 2, 3]}\ngrippers:\n  Hand: {robot: Drawn, fingers: auto}\n`;

mkdirSync('robots/drawn_robot/urdf', {recursive: true});
mkdirSync('robots/drawn_robot/meshes');
mkdirSync('robots/cells');
writeFileSync('robots/drawn_robot/urdf/drawn.urdf', urdf);
writeFileSync('robots/drawn_robot/meshes/base.stl', stl);
writeFileSync('robots/drawn_robot/meshes/arm_one.obj', obj);
writeFileSync('robots/drawn_robot/meshes/hand.dae', dae);
writeFileSync('robots/cells/drawn.yaml', scenario);
writeFileSync('outside.stl', stl);
symlinkSync('../../../outside.stl', 'robots/drawn_robot/meshes/out.stl');

const run = await start('takt-run', ['run', 'robots/cells/drawn.yaml', '--mcap', 'drawn.mcap', '--quiet']);
assert.equal(await run.ended, 0, run.text);
const allowed = ['--files', 'robots/drawn_robot/urdf', '--files', 'robots/drawn_robot'];
const {child, url} = await view(0, 'drawn.mcap', ...allowed);

const got = async (path) => (await fetch(`${url}files/${path}`)).status;
assert.equal(await got('package/drawn_robot/meshes/hand.dae'), 200);
for (const path of ['relative/meshes/out.stl', 'relative/(up)/(up)/outside.stl', 'relative/urdf/drawn.urdf', 'relative/%2e%2e/%2e%2e/outside.stl', 'absolute/etc/hostname', ''])
  assert.equal(await got(path), 404, path);

const browser = await chromium.launch(executable());
const page = await browser.newPage({viewport: {width: 800, height: 600}});
const problems = [];
page.on('pageerror', (error) => problems.push(error.message));
await page.goto(url);
// Boxes around what is drawn of each link, in the world.
const boxes = () => page.evaluate(() => {
  const found = {};
  for (const {model} of takt.cell.robots) {
    model.updateWorldMatrix(true, true);
    model.traverse((part) => {
      if (!part.isMesh) return;
      let link = part;
      while (!link.isURDFLink) {
        if (!link.visible) return;
        link = link.parent;
      }
      const box = (found[link.urdfName] ??= {min: [1e9, 1e9, 1e9], max: [-1e9, -1e9, -1e9]});
      const position = part.geometry.attributes.position;
      for (let i = 0; i < position.count; ++i) {
        const p = takt.cell.camera.position.clone().fromBufferAttribute(position, i).applyMatrix4(part.matrixWorld).toArray();
        p.forEach((value, k) => { box.min[k] = Math.min(box.min[k], value); box.max[k] = Math.max(box.max[k], value); });
      }
    });
  }
  return found;
});
await page.waitForFunction(() => {
  let meshes = 0;
  for (const {model} of takt.cell.robots) model.traverse((part) => { meshes += part.isMesh ? 1 : 0; });
  return takt.last.state && meshes === 6;
}, null, {timeout: 300000});
const near = (found, min, max) => [...min, ...max].forEach((value, i) => assert.ok(Math.abs(value - [...found.min, ...found.max][i]) < 1e-6, `${JSON.stringify(found)} is not ${min} to ${max}`));
const drawn = await boxes();
assert.deepEqual(Object.keys(drawn).sort(), ['arm', 'base_link', 'hand']);
near(drawn.base_link, [1, 2, 3], [1.3, 2.2, 3.1]);
// The joint is turned by 90 degrees: x of the arm is y of the world.
near(drawn.arm, [0.9, 2, 3.1], [1, 2.5, 3.18]);
near(drawn.hand, [0.94, 2.5, 3.1], [1, 2.55, 3.17]);
// It rides on its Ground, which turns by 90 degrees about z here, and moves.
await page.evaluate(() => {
  const state = structuredClone(takt.last.state), [carriage] = state.components;
  carriage.position = {x: 1, y: 5, z: 3};
  carriage.orientation = {x: 0, y: 0, z: Math.SQRT1_2, w: Math.SQRT1_2};
  takt.cell.show(state);
});
near((await boxes()).base_link, [0.8, 5, 3], [1, 5.3, 3.1]);
const joints = await page.evaluate(() => Object.fromEntries(Object.entries(takt.cell.robots[0].model.joints).map(([name, joint]) => [name, joint.jointValue?.[0]])));
for (const [name, value] of [['hinge', 0.2], ['follower', -0.3], ['left_finger', 0], ['right_finger', 0]]) assert.ok(Math.abs(joints[name] - value) < 1e-12, `${name}: ${joints[name]}`);
// The missing mesh is reported with the remedy.
await page.waitForFunction(() => document.querySelector('#answer').textContent.includes('package://elsewhere/meshes/tool.stl'), null, {timeout: 300000});
assert.match(await page.locator('#answer').textContent(), /--files/);
assert.deepEqual(problems, []);
await browser.close();
await stop(child);

// Without any folder there are none.
const closed = await view(0, 'drawn.mcap');
assert.equal((await fetch(`${closed.url}files/relative/meshes/base.stl`)).status, 404);
await stop(closed.child);
console.log('mesh files of a robot are drawn where its joints put them');
process.exit(0);
