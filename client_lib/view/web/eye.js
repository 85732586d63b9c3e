// Where one looks at the cell from, what a pointer meets there, and the scale that goes with it.
import * as THREE from 'three';

const FROM = {iso: [0.75, 1, 0.62], front: [0, -1, 0], right: [1, 0, 0], top: [0, -1e-4, 1], 'iso again': [-0.75, -1, 0.62], 'front again': [0, 1, 0], 'right again': [-1, 0, 0], 'top again': [0, -1e-4, -1]};
const ALIKE = 0.01;  // rad
const FLIGHT = 350;  // ms

export class Eye {
  constructor(cell) {
    Object.assign(this, {cell, past: [], ray: new THREE.Raycaster(), flight: null});
    this.flat = new THREE.OrthographicCamera(-1, 1, 1, -1, -100, 200);
    this.flat.up.set(0, 0, 1);
    this.deep = cell.camera;
    cell.eye = this;
    cell.orbit.addEventListener('start', () => { this.flight = null; this.note(); });
  }

  // Around one component, or all that is drawn; null where there is nothing.
  bounds(of = null) {
    const box = new THREE.Box3();
    this.cell.scene.updateMatrixWorld(true);
    for (const thing of of ? [of] : this.cell.world.children) if (of || thing.visible) box.expandByObject(thing);
    return box.isEmpty() ? null : box;
  }

  // Of the box around each thing that is drawn.
  corners(of = null) {
    const found = [];
    this.cell.scene.updateMatrixWorld(true);
    for (const thing of of ? [of] : this.cell.world.children.filter(({visible}) => visible)) {
      const {min, max} = new THREE.Box3().expandByObject(thing);
      for (let i = 0; i < 8 && min.x <= max.x; ++i) found.push(new THREE.Vector3((i & 1 ? max : min).x, (i & 2 ? max : min).y, (i & 4 ? max : min).z));
    }
    return found;
  }

  // From this side, or from the opposite one where that is the view.
  side(name) {
    const {camera, orbit} = this.cell, from = this.flight ? this.flight.to.clone().sub(this.flight.at) : camera.position.clone().sub(orbit.target), there = new THREE.Vector3(...FROM[name]);
    this.fit(from.angleTo(there) < ALIKE ? `${name} again` : name);
  }

  // From `direction` (kept without one) so that all is in the picture, below the tools, with some air around it.
  fit(direction = null, of = null, fly = true) {
    const box = this.bounds(of), {cell} = this;
    if (!box) return;
    const towards = direction ? new THREE.Vector3(...FROM[direction]).normalize() : cell.camera.position.clone().sub(cell.orbit.target).normalize();
    const target = box.getCenter(new THREE.Vector3()), frame = new THREE.Matrix4().lookAt(towards, new THREE.Vector3(), new THREE.Vector3(0, 0, 1));
    const [right, up] = [0, 1].map((axis) => new THREE.Vector3().setFromMatrixColumn(frame, axis)), corners = this.corners(of), look = frame.clone().invert(), seen = new THREE.Vector3();
    // Parts of half the picture: how far to the side, below and above things may be.
    const {canvas} = cell, tools = canvas.parentElement.querySelector('#camera'), scale = canvas.parentElement.querySelector('#scale-bar'), tall = Math.max(canvas.clientHeight, 1), covered = of ? 0 : (tools.offsetTop + tools.offsetHeight) / tall;
    const high = Math.tan(THREE.MathUtils.degToRad(this.deep.fov / 2)), wide = high * this.deep.aspect, side = 0.93, below = of ? 0.93 : Math.max(0.97 - 2 * (tall - scale.offsetTop) / tall, 0.3), above = Math.max(0.97 - 2 * covered, 0.3);
    let distance = 0;
    // The middle of what is seen comes to the middle of the room for it: a few times, since what is near looks larger.
    for (let round = 0; round < 6; ++round) {
      distance = 0.1;
      const extent = {left: Infinity, right: -Infinity, low: Infinity, top: -Infinity};
      for (const corner of corners) {
        const {x, y, z} = seen.copy(corner).sub(target).applyMatrix4(look);
        distance = Math.max(distance, z + Math.abs(x) / (side * wide), z + (y > 0 ? y / (above * high) : -y / (below * high)));
      }
      for (const corner of corners) {
        const {x, y, z} = seen.copy(corner).sub(target).applyMatrix4(look), depth = distance - z;
        Object.assign(extent, {left: Math.min(extent.left, x / depth), right: Math.max(extent.right, x / depth), low: Math.min(extent.low, y / depth), top: Math.max(extent.top, y / depth)});
      }
      if (round < 5 && corners.length) target.addScaledVector(right, distance * (extent.left + extent.right) / 2).addScaledVector(up, distance * ((extent.low + extent.top) / 2 - high * (above - below) / 2));
    }
    if (of) distance = Math.max(distance * 1.6, 0.1);
    const position = target.clone().addScaledVector(towards, distance);
    if (!fly) { cell.camera.position.copy(position); cell.orbit.target.copy(target); cell.orbit.update(); cell.dirty = true; return; }
    this.note();
    this.fly(position, target);
  }

  fly(position, target) {
    const {cell} = this, still = matchMedia('(prefers-reduced-motion: reduce)').matches;
    this.flight = {began: performance.now(), time: still ? 0 : FLIGHT, from: cell.camera.position.clone(), to: position, target: cell.orbit.target.clone(), at: target};
    cell.dirty = true;
  }

  // Each frame: the flight goes on, and the flat camera shows as much as the deep one.
  step() {
    const {cell, flight, flat} = this;
    if (flight) {
      const part = flight.time ? Math.min((performance.now() - flight.began) / flight.time, 1) : 1, smooth = part * part * (3 - 2 * part);
      cell.camera.position.lerpVectors(flight.from, flight.to, smooth);
      cell.orbit.target.lerpVectors(flight.target, flight.at, smooth);
      if (part >= 1) { this.flight = null; cell.orbit.dispatchEvent({type: 'end'}); }
      cell.dirty = true;
    }
    if (cell.camera === flat) {
      const high = flat.position.distanceTo(cell.orbit.target) * Math.tan(THREE.MathUtils.degToRad(this.deep.fov / 2));
      Object.assign(flat, {left: -high * this.deep.aspect, right: high * this.deep.aspect, top: high, bottom: -high});
      flat.updateProjectionMatrix();
    }
  }

  orthographic(on) {
    const {cell} = this, camera = on ? this.flat : this.deep;
    camera.position.copy(cell.camera.position);
    camera.quaternion.copy(cell.camera.quaternion);
    cell.camera = cell.orbit.object = camera;
    cell.orbit.update();
    cell.dirty = true;
  }

  // One step of a key: around the target by 5 degrees, or along the picture by a twentieth of its height.
  turn(key, along) {
    const {cell} = this, {camera, orbit} = cell, side = {ArrowLeft: -1, ArrowRight: 1}[key] ?? 0, up = {ArrowDown: -1, ArrowUp: 1}[key] ?? 0, from = camera.position.clone().sub(orbit.target);
    this.flight = null;
    this.note();
    if (along) {
      const step = new THREE.Vector3(side, up, 0).multiplyScalar(0.1 * from.length() * Math.tan(THREE.MathUtils.degToRad(this.deep.fov / 2))).applyQuaternion(camera.quaternion);
      camera.position.add(step);
      orbit.target.add(step);
    } else {
      const at = new THREE.Spherical().setFromVector3(new THREE.Vector3(from.x, from.z, -from.y)), step = THREE.MathUtils.degToRad(5);
      Object.assign(at, {theta: at.theta + side * step, phi: Math.min(Math.max(at.phi - up * step, 0.01), Math.PI - 0.01)});
      const {x, y, z} = new THREE.Vector3().setFromSpherical(at);
      camera.position.copy(orbit.target).add(from.set(x, -z, y));
    }
    this.moved();
  }
  near(factor) {
    const {camera, orbit} = this.cell;
    this.flight = null;
    this.note();
    camera.position.sub(orbit.target).multiplyScalar(factor).add(orbit.target);
    this.moved();
  }
  moved() {
    this.cell.orbit.update();
    this.cell.orbit.dispatchEvent({type: 'end'});
    this.cell.dirty = true;
  }
  middle() { return {offsetX: this.cell.canvas.clientWidth / 2, offsetY: this.cell.canvas.clientHeight / 2}; }

  // The views before this one, for the way back.
  note() {
    this.past.push({position: this.cell.camera.position.clone(), target: this.cell.orbit.target.clone()});
    if (this.past.length > 50) this.past.shift();
  }
  back() {
    const last = this.past.pop();
    if (last) this.fly(last.position, last.target);
  }

  // What is drawn under a place of the canvas: {chosen, point, normal} or null. Contacts only with `contacts`.
  pick({offsetX, offsetY}, contacts = false) {
    const {cell} = this, at = new THREE.Vector2(2 * offsetX / cell.canvas.clientWidth - 1, 1 - 2 * offsetY / cell.canvas.clientHeight);
    this.ray.setFromCamera(at, cell.camera);
    if (contacts)
      for (const hit of this.ray.intersectObjects(cell.marks.children.filter(({visible}) => visible), true)) {
        let thing = hit.object;
        while (thing && !thing.userData.says) thing = thing.parent;
        if (thing) return {says: thing.userData.says(), point: hit.point};
      }
    for (const hit of this.ray.intersectObject(cell.world, true)) {
      if (!hit.object.isMesh || !hit.object.visible || (cell.section && cell.plane.distanceToPoint(hit.point) < 0)) continue;
      let thing = hit.object;
      while (thing && !thing.userData.chosen) thing = thing.parent;
      if (thing) return {chosen: thing.userData.chosen, point: hit.point, normal: hit.face?.normal.clone().transformDirection(hit.object.matrixWorld)};
    }
    return null;
  }

  // A round length of 60 to 150 pixels at the target, and its pixels.
  scale() {
    const {cell} = this, perPixel = 2 * cell.camera.position.distanceTo(cell.orbit.target) * Math.tan(THREE.MathUtils.degToRad(this.deep.fov / 2)) / Math.max(cell.canvas.clientHeight, 1);
    const most = 150 * perPixel, ten = 10 ** Math.floor(Math.log10(most)), length = most >= 5 * ten ? 5 * ten : most >= 2 * ten ? 2 * ten : ten;
    return {length, pixels: length / perPixel};
  }
}

// From one point on a surface to another, with the angle between their faces.
export class Ruler {
  constructor(cell) {
    this.cell = cell;
    this.points = [];
    this.line = new THREE.Line(new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3()]), new THREE.LineBasicMaterial({color: 0xf0b000, depthTest: false}));
    this.line.visible = this.line.frustumCulled = false;
    this.line.renderOrder = 5;
    cell.scene.add(this.line);
  }
  clear() { this.points = []; this.line.visible = false; this.cell.dirty = true; }
  // The sentence of the measurement once there are two points.
  take({point, normal}) {
    if (this.points.length === 2) this.clear();
    this.points.push({point, normal});
    if (this.points.length < 2) return 'Measure: click the second point.';
    const [a, b] = this.points, along = b.point.clone().sub(a.point), at = this.line.geometry.attributes.position;
    at.setXYZ(0, ...a.point.toArray());
    at.setXYZ(1, ...b.point.toArray());
    at.needsUpdate = true;
    this.line.visible = this.cell.dirty = true;
    const mm = (value) => (1000 * value).toFixed(2);
    const turn = a.normal && b.normal ? THREE.MathUtils.radToDeg(Math.acos(Math.max(-1, Math.min(1, a.normal.dot(b.normal))))) : null;
    const gap = turn !== null && (turn < 1 || turn > 179) ? `; parallel faces, ${mm(Math.abs(along.dot(a.normal)))} mm apart` : turn !== null ? `; faces at ${turn.toFixed(1)}°` : '';
    return `${mm(along.length())} mm (x ${mm(along.x)}, y ${mm(along.y)}, z ${mm(along.z)})${gap}`;
  }
}
