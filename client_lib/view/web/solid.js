// Whether a mesh is the surface of a solid: each edge has as many triangles along it one way as the other, and they enclose a
// volume that is behind them. From outside no back of such a mesh is ever seen.
const FINE = 1e6;  // corners that differ by less than a part of this are one

const mixed = (value) => { let h = value | 0; h = Math.imul(h ^ (h >>> 16), 0x85ebca6b); h = Math.imul(h ^ (h >>> 13), 0xc2b2ae35); return h ^ (h >>> 16); };

// Numbers of edges, made of those of their ends, sum up to zero where each edge runs both ways; else with a chance of 2^-32.
export function isSolid({attributes: {position}, index}) {
  const count = index ? index.count : position.count, names = new Int32Array(position.count), at = [0, 1, 2].map(() => [0, 0, 0]);
  for (let i = 0; i < position.count; ++i) names[i] = mixed(mixed(mixed(Math.round(FINE * position.getX(i))) + Math.round(FINE * position.getY(i))) + Math.round(FINE * position.getZ(i)));
  let edges = 0, volume = 0;
  const along = (a, b) => { edges += a < b ? mixed(mixed(a) + b) : -mixed(mixed(b) + a); };
  for (let i = 0; i + 2 < count; i += 3) {
    const corners = [0, 1, 2].map((k) => (index ? index.getX(i + k) : i + k)), [a, b, c] = corners.map((corner) => names[corner]);
    if (a === b || b === c || c === a) continue;  // without a face
    along(a, b), along(b, c), along(c, a);
    corners.forEach((corner, k) => { at[k][0] = position.getX(corner), at[k][1] = position.getY(corner), at[k][2] = position.getZ(corner); });
    const [p, q, r] = at;
    volume += p[0] * (q[1] * r[2] - q[2] * r[1]) + p[1] * (q[2] * r[0] - q[0] * r[2]) + p[2] * (q[0] * r[1] - q[1] * r[0]);
  }
  return count > 0 && edges === 0 && volume > 0;
}
