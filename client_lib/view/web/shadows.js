// What casts shadows, and where on the floor they are.
import * as THREE from 'three';

// Numbers that differ once something that casts a shadow has moved, appears or is gone.
export function shadows(world) {
  const found = [];
  world.traverseVisible(({castShadow, geometry, matrixWorld: {elements}}) => {
    if (!castShadow) return;
    found.push(geometry.id);
    for (let i = 0; i < 16; ++i) found.push(elements[i]);
  });
  return found;
}

// Of points [x, y], counterclockwise (Andrew 1979).
export function hull(points) {
  const turn = ([ax, ay], [bx, by], [cx, cy]) => (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
  const chain = (sorted) => {
    const found = [];
    for (const point of sorted) {
      while (found.length > 1 && turn(found.at(-2), found.at(-1), point) <= 0) found.pop();
      found.push(point);
    }
    return found.slice(0, -1);
  };
  const sorted = points.toSorted(([ax, ay], [bx, by]) => ax - bx || ay - by);
  return [...chain(sorted), ...chain(sorted.toReversed())];
}

// The floor at this height gets the outline of all shadows of parallel light, this much larger: most of a picture is floor, and
// without shadow it has nothing to show.
export function cover(floor, world, height, {position, target}, margin) {
  const way = target.position.clone().sub(position), at = new THREE.Vector3(), points = [];
  world.traverseVisible(({castShadow, geometry, matrixWorld}) => {
    if (!castShadow || !geometry.attributes.position) return;
    if (!geometry.boundingBox) geometry.computeBoundingBox();
    const {min, max} = geometry.boundingBox;
    for (let i = 0; i < 8; ++i) {
      at.set((i & 1 ? max : min).x, (i & 2 ? max : min).y, (i & 4 ? max : min).z).applyMatrix4(matrixWorld);
      at.addScaledVector(way, (height - at.z) / way.z);
      points.push([at.x, at.y]);
    }
  });
  const outline = hull(hull(points).flatMap(([x, y]) => [[-1, -1], [-1, 1], [1, -1], [1, 1]].map(([i, k]) => [x + i * margin, y + k * margin])));
  floor.geometry.dispose();
  floor.geometry = new THREE.BufferGeometry();
  floor.geometry.setAttribute('position', new THREE.Float32BufferAttribute(outline.flatMap(([x, y]) => [x, y, height]), 3));
  floor.geometry.setAttribute('normal', new THREE.Float32BufferAttribute(outline.flatMap(() => [0, 0, 1]), 3));
  floor.geometry.setIndex(outline.slice(2).flatMap((_, i) => [0, i + 1, i + 2]));
}
