// Normals of curved meshes (creased_normals.js) against closed forms, at any size of the mesh.
import {strict as assert} from 'node:assert';

const {creasedNormals} = await import(`${process.env.TAKT_SOURCES}/client_lib/view/web/creased_normals.js`);

// A prism with `sides` sides, each cap a fan around its middle: corners, triangles.
const prism = (sides, size) => {
  const corners = [0, 0, 0, 0, 0, size], triangles = [];
  for (let i = 0; i < sides; ++i) for (const z of [0, size]) corners.push(size * Math.cos(2 * Math.PI * i / sides), size * Math.sin(2 * Math.PI * i / sides), z);
  for (let i = 0; i < sides; ++i) {
    const [low, high, lower, higher] = [2 + 2 * i, 3 + 2 * i, 2 + 2 * ((i + 1) % sides), 3 + 2 * ((i + 1) % sides)];
    triangles.push(0, lower, low, 1, high, higher, low, lower, higher, low, higher, high);
  }
  return [Float32Array.from(corners), Uint32Array.from(triangles)];
};
const largest = (positions, triangles, crease, expected) => {
  const {position, normal, index} = creasedNormals(positions, triangles, crease);
  let error = 0;
  for (let corner = 0; corner < triangles.length; ++corner) {
    const own = [0, 1, 2].map((axis) => position[3 * index[corner] + axis]), given = [0, 1, 2].map((axis) => positions[3 * triangles[corner] + axis]);
    assert.deepEqual(own, given);
    const face = corner - corner % 3, [a, b, c] = [0, 1, 2].map((k) => [0, 1, 2].map((axis) => positions[3 * triangles[face + k] + axis]));
    expected(own, [a, b, c]).forEach((value, axis) => { error = Math.max(error, Math.abs(value - normal[3 * index[corner] + axis])); });
  }
  return [error, normal.length / 3];
};
const isCap = ([a, b, c]) => a[2] === b[2] && b[2] === c[2];

for (const size of [1e-4, 0.01, 1, 1000]) {
  // 24 sides meet at 15 degrees: round, with a crease at the caps. A corner's normal is along its radius.
  const round = largest(...prism(24, size), 0.5, ([x, y, z], face) => (isCap(face) ? [0, 0, z > 0 ? 1 : -1] : [x / Math.hypot(x, y), y / Math.hypot(x, y), 0]));
  assert.ok(round[0] < 1e-6, `round, of size ${size}: ${round[0]}`);
  assert.equal(round[1], 24 * 2 * 2 + 2);  // side and cap of each corner, and the two middles
  // 6 sides meet at 60 degrees: flat.
  const flat = largest(...prism(6, size), 0.5, ([, , z], face) => {
    if (isCap(face)) return [0, 0, z > 0 ? 1 : -1];
    const [x, y] = [0, 1].map((axis) => Math.min(...face.map((p) => p[axis])) + Math.max(...face.map((p) => p[axis])));
    return [x / Math.hypot(x, y), y / Math.hypot(x, y), 0];
  });
  assert.ok(flat[0] < 1e-6, `flat, of size ${size}: ${flat[0]}`);
}
// A triangle without area has no say, and costs nothing.
const [corners, triangles] = prism(24, 1);
const [error] = largest(corners, Uint32Array.from([...triangles, 2, 2, 3]), 0.5, ([x, y, z], face) => {
  if (face[0] === face[1] || face.some((p, i) => face.some((q, j) => i < j && p.every((v, k) => v === q[k])))) return [0, 0, 0];
  return isCap(face) ? [0, 0, z > 0 ? 1 : -1] : [x / Math.hypot(x, y), y / Math.hypot(x, y), 0];
});
assert.ok(error < 1e-6, String(error));
console.log('normals of prisms at four sizes, and of triangles without area');
