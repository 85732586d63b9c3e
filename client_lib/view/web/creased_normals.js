// Normals of a mesh that looks curved where its faces meet at less than an angle, and has a crease elsewhere.

// Corners of triangles: x, y, z of `positions` at the indices of `triangles`; `crease` in rad. A corner's normal is the mean of
// those of the faces around its point within the crease, by their angles there (Thürmer and Wüthrich 1998). Points are one where
// their coordinates are equal, so the size of a mesh does not matter. {position, normal, index}; corners with one point and one
// normal are one.
export function creasedNormals(positions, triangles, crease) {
  const corners = triangles.length, least = Math.cos(crease), points = new Int32Array(corners), known = new Map();
  for (let corner = 0; corner < corners; ++corner) {
    const at = 3 * triangles[corner], key = `${positions[at]},${positions[at + 1]},${positions[at + 2]}`;
    let point = known.get(key);
    if (point === undefined) known.set(key, point = known.size);
    points[corner] = point;
  }
  const faces = new Float64Array(corners), angles = new Float64Array(corners), sides = [new Float64Array(3), new Float64Array(3), new Float64Array(3)], lengths = [0, 0, 0];
  for (let face = 0; face + 2 < corners; face += 3) {
    for (let k = 0; k < 3; ++k) {
      const from = 3 * triangles[face + k], to = 3 * triangles[face + (k + 1) % 3];
      for (let axis = 0; axis < 3; ++axis) sides[k][axis] = positions[to + axis] - positions[from + axis];
      lengths[k] = Math.hypot(...sides[k]);
    }
    const [[ax, ay, az], [bx, by, bz]] = sides, x = ay * bz - az * by, y = az * bx - ax * bz, z = ax * by - ay * bx, area = Math.hypot(x, y, z);
    if (!(area > 0)) continue;  // without a normal
    faces[face] = x / area, faces[face + 1] = y / area, faces[face + 2] = z / area;
    for (let k = 0; k < 3; ++k) {
      const next = sides[k], last = sides[(k + 2) % 3], cosine = -(next[0] * last[0] + next[1] * last[1] + next[2] * last[2]) / (lengths[k] * lengths[(k + 2) % 3]);
      angles[face + k] = Math.acos(Math.min(1, Math.max(-1, cosine)));
    }
  }
  // The corners at each point, one point after the other.
  const begin = new Int32Array(known.size + 1), around = new Int32Array(corners);
  for (const point of points) ++begin[point + 1];
  for (let point = 0; point < known.size; ++point) begin[point + 1] += begin[point];
  const next = begin.slice();
  for (let corner = 0; corner < corners; ++corner) around[next[points[corner]]++] = corner;
  const position = [], normal = [], index = new Uint32Array(corners);
  for (let point = 0; point < known.size; ++point) {
    const first = normal.length, planes = [];  // of each plane around the point: a face, and the angle of all its faces there
    for (let i = begin[point]; i < begin[point + 1]; ++i) {
      const corner = around[i], face = corner - corner % 3;
      const same = planes.find(([other]) => faces[other] === faces[face] && faces[other + 1] === faces[face + 1] && faces[other + 2] === faces[face + 2]);
      if (same) same[1] += angles[corner]; else planes.push([face, angles[corner]]);
    }
    for (let i = begin[point]; i < begin[point + 1]; ++i) {
      const corner = around[i], own = corner - corner % 3;
      let x = 0, y = 0, z = 0;
      for (const [face, angle] of planes) {
        if (faces[own] * faces[face] + faces[own + 1] * faces[face + 1] + faces[own + 2] * faces[face + 2] <= least) continue;
        x += angle * faces[face], y += angle * faces[face + 1], z += angle * faces[face + 2];
      }
      const length = Math.hypot(x, y, z) || 1;
      x /= length, y /= length, z /= length;
      let place = first;
      while (place < normal.length && Math.abs(normal[place] - x) + Math.abs(normal[place + 1] - y) + Math.abs(normal[place + 2] - z) > 1e-6) place += 3;
      if (place === normal.length) {
        const at = 3 * triangles[corner];
        position.push(positions[at], positions[at + 1], positions[at + 2]);
        normal.push(x, y, z);
      }
      index[corner] = place / 3;
    }
  }
  return {position: Float32Array.from(position), normal: Float32Array.from(normal), index};
}
