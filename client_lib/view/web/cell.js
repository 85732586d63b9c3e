// The cell in 3D: components with the meshes of the description, robots from their URDF, forces, contacts, holding relations.
import * as THREE from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import {ColladaLoader} from 'three/addons/loaders/ColladaLoader.js';
import {OBJLoader} from 'three/addons/loaders/OBJLoader.js';
import {RoomEnvironment} from 'three/addons/environments/RoomEnvironment.js';
import {STLLoader} from 'three/addons/loaders/STLLoader.js';
import URDFLoader from 'urdf-loader';
import {breakEdges} from './broken_edges.js';
import {creasedNormals} from './creased_normals.js';
import {Heat} from './heat.js';
import {Quality, drawnByProcessor} from './quality.js';
import {FORCES, PRESSURE, Scale} from './scales.js';
import {cover, shadows} from './shadows.js';
import {isSolid} from './solid.js';
import {ComponentType, JointType, PartState, nameOf} from './messages.js';

// Words and colours of Parts, by PartState.
export const STATES = Object.fromEntries([PartState.free, PartState.grasped, PartState.placed, PartState.assembled].map((state) => [state, state === PartState.grasped ? 'held' : nameOf(PartState, state)]));
export const STATE_COLORS = {[PartState.free]: 0x7f8c97, [PartState.grasped]: 0xe08214, [PartState.placed]: 0x2c7fb8, [PartState.assembled]: 0x2e9e5b};
export const OPEN = 0x9aa7b4, CLOSED = 0xc2561a, GRIPS = 0xe08214, FORCE = 0xd6204e, CONTACT = 0x8a2be2, HOLDS = 0x20639b;
export const LONGEST = 0.25;  // m; larger forces are drawn like this, as they would leave the picture
const TINT = 0.4;      // share of the colour of a part's state in that of the part
const HEAT = 0.85;     // the same of its temperature, which can be read off a scale
const MOST_EDGES = 60000;  // triangles of a mesh whose edges are drawn, and that looks curved between them
const CREASE = 0.5;        // rad; faces that meet at more have a drawn edge
const SHADE_PERIOD = {hard: 40, soft: 1000};  // ms between two pictures of the shadows: with a graphics card, and drawn by the processor
const STANDS = 250;  // ms without anything new to draw, after which the last picture is drawn in full
const STATE = new THREE.Color();
const UP = new THREE.Vector3(0, 1, 0);

function matrixOf({position, rotation: r}) {
  return new THREE.Matrix4().set(r.xx, r.xy, r.xz, position.x, r.yx, r.yy, r.yz, position.y, r.zx, r.zy, r.zz, position.z, 0, 0, 0, 1);
}

// Colours of a URDF are sRGB, as pictures of takt-run and RViz take them; the loader takes them as linear.
function withLinearColors(urdf) {
  const document = new DOMParser().parseFromString(urdf, 'text/xml');
  for (const element of document.querySelectorAll('color[rgba]')) {
    const [r, g, b, ...alpha] = element.getAttribute('rgba').trim().split(/\s+/).map(Number);
    element.setAttribute('rgba', [...new THREE.Color().setRGB(r, g, b, THREE.SRGBColorSpace).toArray(), ...alpha].join(' '));
  }
  return document;
}

// Shapes that many marks share.
const SHAFT = new THREE.CylinderGeometry(0.004, 0.004, 1, 12), TIP = new THREE.ConeGeometry(0.012, 0.04, 16), DISC = new THREE.CircleGeometry(1, 32);

// What a graphics card keeps of all that is in `of`. Its shapes are in no other picture, but for the shared ones.
function free(of) {
  of.traverse(({geometry, material}) => {
    if (geometry && ![SHAFT, TIP, DISC].includes(geometry)) geometry.dispose();
    for (const one of [material ?? []].flat()) { one.map?.dispose(); one.dispose(); }
  });
}

class Arrow extends THREE.Group {
  constructor(color) {
    super();
    this.material = new THREE.MeshStandardMaterial({color});
    this.shaft = new THREE.Mesh(SHAFT, this.material);
    this.tip = new THREE.Mesh(TIP, this.material);
    this.add(this.shaft, this.tip);
    this.visible = false;
  }
  set(from, along) {
    const asked = along.length(), length = Math.min(asked, LONGEST);
    this.visible = length > 1e-4;
    if (!this.visible) return;
    this.position.copy(from);
    this.quaternion.setFromUnitVectors(UP, along.clone().divideScalar(asked));
    const tip = Math.min(0.04, 0.5 * length);
    this.shaft.scale.set(1, Math.max(length - tip, 1e-6), 1);
    this.shaft.position.y = 0.5 * (length - tip);
    this.tip.scale.setScalar(tip / 0.04);
    this.tip.position.y = length - 0.5 * tip;
  }
}

function curved({attributes: {position: {array}}, index: {array: triangles}}) {
  const {position, normal, index} = creasedNormals(array, triangles, CREASE), made = new THREE.BufferGeometry();
  made.setAttribute('position', new THREE.BufferAttribute(position, 3));
  made.setAttribute('normal', new THREE.BufferAttribute(normal, 3));
  return made.setIndex(new THREE.BufferAttribute(index, 1));
}

// THREE.EdgesGeometry takes points within 1e-4 for one: here that is a millionth of the mesh.
function edgesOf(geometry) {
  geometry.computeBoundingSphere();
  const unit = 100 / (geometry.boundingSphere.radius || 1), scaled = geometry.clone().scale(unit, unit, unit);
  const edges = new THREE.EdgesGeometry(scaled, THREE.MathUtils.radToDeg(CREASE)).scale(1 / unit, 1 / unit, 1 / unit);
  scaled.dispose();
  return edges;
}

export class Cell {
  constructor(canvas) {
    this.canvas = canvas;
    this.options = {byState: true, byTemperature: false, byForce: false, forces: true, contacts: true, holding: true, edges: true, frames: false, metresPerNewton: 0.03, follow: ''};
    THREE.Object3D.DEFAULT_UP.set(0, 0, 1);
    this.soft = drawnByProcessor();
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: !this.soft, preserveDrawingBuffer: true});
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.localClippingEnabled = true;
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(0xe9edf1);
    this.camera = new THREE.PerspectiveCamera(40, 1, 0.01, 100);
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(0.9, 2.7, 2.0);
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.target.set(0, -0.1, 0.85);
    this.orbit.addEventListener('change', () => { this.dirty = true; });
    this.renderer.toneMapping = THREE.ACESFilmicToneMapping;
    this.quality = new Quality(this.renderer);
    this.light();
    this.plane = new THREE.Plane(new THREE.Vector3(-1, 0, 0), 0);
    this.world = new THREE.Group();
    this.marks = new THREE.Group();
    this.scene.add(this.world, this.marks);
    this.components = [];
    this.robots = [];
    this.triads = [];  // frames
    this.heat = new Heat();
    this.scales = {force: new Scale(FORCES, 'N'), pressure: new Scale(PRESSURE, 'Pa')};
    this.largest = {parts: 0, contacts: 0};  // N
    this.dirty = true;
    this.draw = this.draw.bind(this);
    requestAnimationFrame(this.draw);
  }

  // A room around, the sky, and a sun with shadows. Without a graphics card shadows are drawn rarely.
  light() {
    const {renderer, scene} = this;
    if (!this.soft) {
      const pmrem = new THREE.PMREMGenerator(renderer);
      scene.environment = pmrem.fromScene(new RoomEnvironment(), 0.04).texture;
      scene.environmentIntensity = 0.35;
      pmrem.dispose();
    }
    this.sky = new THREE.HemisphereLight(0xffffff, 0x8f959c, this.soft ? 1.9 : 1.3);
    this.sun = new THREE.DirectionalLight(0xfff6e8, 2.4);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.setScalar(2048);
    this.sun.shadow.normalBias = 0.01;
    renderer.shadowMap.enabled = true;
    renderer.shadowMap.type = this.soft ? THREE.BasicShadowMap : THREE.PCFSoftShadowMap;
    renderer.shadowMap.autoUpdate = false;
    this.floor = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.ShadowMaterial({opacity: 0.22}));
    this.floor.frustumCulled = false;
    this.floor.receiveShadow = true;
    scene.add(this.sky, this.sun, this.sun.target, this.floor);
    this.paint(false);
    this.lay(new THREE.Vector3(), 3, 0);
  }

  // Colours of the ground and of the sky.
  paint(dark) {
    this.dark = dark;
    this.scene.background = new THREE.Color(dark ? 0x20272f : 0xe4e9ef);
    if (this.grid) this.lay(this.middle, this.radius, this.low);
    for (const {edges} of this.components ?? []) edges?.material.color.set(dark ? 0x0c0f12 : 0x2a323a);
    this.dirty = true;
  }

  // Ground with lines every 0.1 m in small cells and 1 m in large ones, below all that is drawn, and the sun around it.
  lay(middle, radius, low) {
    Object.assign(this, {middle, radius, low});
    const step = radius < 0.4 ? 0.05 : radius < 4 ? 0.25 : 1, half = Math.max(Math.ceil(2 * radius / step), 4) * step, center = new THREE.Vector3(Math.round(middle.x / step) * step, Math.round(middle.y / step) * step, low - 0.001);
    this.grid?.removeFromParent();
    this.grid?.dispose();
    this.grid = new THREE.GridHelper(2 * half, Math.round(2 * half / step), this.dark ? 0x55606c : 0xa4adb7, this.dark ? 0x343d47 : 0xcbd2d9);
    this.grid.rotation.x = Math.PI / 2;
    this.grid.position.copy(center);
    this.scene.add(this.grid);
    this.sun.position.set(middle.x + 1.2 * radius, middle.y - 1.4 * radius, middle.z + 2.6 * radius);
    this.sun.target.position.copy(middle);
    Object.assign(this.sun.shadow.camera, {left: -1.5 * radius, right: 1.5 * radius, top: 1.5 * radius, bottom: -1.5 * radius, near: 0.1 * radius, far: 8 * radius});
    this.sun.shadow.camera.updateProjectionMatrix();
    this.cast = null;
    this.dirty = true;
  }

  // One thing of the cell is marked: a box around it. {kind, name} or null.
  select(chosen) {
    this.held = null;  // component that a user drags
    this.mark?.removeFromParent();
    this.mark?.dispose();
    this.mark = null;
    this.chosen = chosen && this.world.children.find(({name, userData: {chosen: is}}) => (chosen.kind === 'component' ? name === chosen.name : is?.kind === chosen.kind && is.name === chosen.name)) || null;
    if (chosen?.kind === 'gripper') this.chosen = this.components[this.grippers.find(({name}) => name === chosen.name)?.palm]?.mesh ?? null;
    if (this.chosen) this.scene.add(this.mark = new THREE.BoxHelper(this.chosen, 0x1f8fff));
    this.dirty = true;
  }

  setFrames(on) {
    for (const {axes, parent} of this.triads) if (on) parent.add(axes); else axes.removeFromParent();  // boxes are around what is there
    this.dirty = true;
  }
  setEdges(on) {
    for (const {edges} of this.components) if (edges) edges.visible = on;
    this.dirty = true;
  }

  describe(description) {
    this.select(null);
    for (const {axes} of this.triads) free(axes);
    for (const group of [this.world, this.marks]) { free(group); group.clear(); }
    this.triads = [];
    this.description = description;
    this.heat.describe(description);
    for (const scale of Object.values(this.scales)) scale.clear();
    this.largest = {parts: 0, contacts: 0};
    const grips = new Map(description.grippers.flatMap(({name, palm, left_jaw: left, right_jaw: right}) => [palm, left, right].map((i) => [i, name])));
    this.components = description.components.map((component, index) => {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute('position', new THREE.BufferAttribute(Float32Array.from(component.vertices), 3));
      geometry.setIndex(new THREE.BufferAttribute(Uint32Array.from(component.triangles), 1));
      const drawn = component.triangles.length / 3 <= MOST_EDGES ? curved(geometry) : geometry.toNonIndexed();
      if (!drawn.attributes.normal) drawn.computeVertexNormals();
      const [r, g, b] = component.color.length >= 3 ? component.color : [0.7, 0.7, 0.7];
      const own = new THREE.Color().setRGB(r, g, b, THREE.SRGBColorSpace);
      const mesh = new THREE.Mesh(drawn, new THREE.MeshStandardMaterial({color: own, roughness: 0.6, metalness: 0.1, side: THREE.DoubleSide}));
      this.turn(mesh);
      mesh.name = component.name;
      mesh.userData.chosen = grips.has(index) ? {kind: 'gripper', name: grips.get(index)} : {kind: 'component', name: component.name};
      mesh.castShadow = mesh.receiveShadow = true;
      let edges = null;
      if (component.triangles.length / 3 <= MOST_EDGES) {
        edges = new THREE.LineSegments(edgesOf(geometry), new THREE.LineBasicMaterial({color: this.dark ? 0x0c0f12 : 0x2a323a, transparent: true, opacity: 0.55}));
        edges.visible = this.options.edges;
        edges.raycast = () => {};
        mesh.add(edges);
      }
      this.addFrame(mesh, 0.06);
      this.world.add(mesh);
      const arrow = new Arrow(FORCE), line = new THREE.Line(
        new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3()]), new THREE.LineBasicMaterial({color: HOLDS, depthTest: false, transparent: true}));
      line.renderOrder = 2;  // after what is in front of it
      line.visible = false;
      line.frustumCulled = false;
      this.marks.add(arrow, line);
      return {mesh, own, edges, arrow, line, type: component.type};
    });
    this.grippers = description.grippers;
    this.missing = new Set();  // mesh files of robots that could not be had
    this.robots = description.robots.map((robot, i) => {
      const loader = new URDFLoader();
      loader.packages = (name) => `package:${name}`;
      loader.loadMeshCb = (path, manager, done) => this.loadMesh(path, manager, done);
      let model;
      try {
        model = loader.parse(withLinearColors(robot.urdf));
      } catch {
        model = new THREE.Group();
      }
      this.dress(model);
      this.settle(model, robot, i);
      const base = new THREE.Group();
      base.matrixAutoUpdate = false;
      base.matrix.copy(matrixOf(robot.base));
      base.userData.chosen = {kind: 'robot', name: robot.name};
      base.add(model);
      this.world.add(base);
      if (robot.mounted_on < 0) this.stand(robot);
      this.addRobotFrames(base, model, robot, i);
      return {model, base, ground: robot.mounted_on, mount: matrixOf(robot.mount), joints: robot.joints.map((joint) => joint.name)};
    });
    this.patches = [];
    this.pressed = new Map();  // pairs whose elements are shown
    this.setSection(this.section, this.cut);
    this.dirty = true;
  }

  addFrame(parent, size, matrix = null) {
    const axes = new THREE.AxesHelper(size);
    axes.raycast = () => {};
    if (matrix) { axes.matrixAutoUpdate = false; axes.matrix.copy(matrix); }
    if (this.options.frames) parent.add(axes);
    this.triads.push({parent, axes});
  }
  // Base, flange, and the tool centre points of the grippers that the robot carries.
  addRobotFrames(base, model, robot, index) {
    this.addFrame(base, 0.2);
    const last = model.joints?.[robot.joints.at(-1)?.name];
    if (!last) return;
    const flange = matrixOf(robot.flange);
    this.addFrame(last, 0.08, flange);
    for (const {robot: carrier, mount, tool_center_point: point} of this.grippers) if (carrier === index) this.addFrame(last, 0.06, flange.clone().multiply(matrixOf(mount)).multiply(matrixOf(point)));
  }

  // Joints beside the chain stand where takt has them: nearest to zero within their limits, or where a mimic leads them. Links
  // that a gripper out of the URDF consists of are drawn as its components; the name of its palm's mesh lists them.
  settle(model, robot, index) {
    const joints = Object.values(model.joints ?? {}), driven = new Set(robot.joints.map(({name}) => name));
    for (const joint of joints) joint.ignoreLimits = true;  // takt checks them, and assumes those that are not stated
    for (const joint of joints) {
      const limited = !['fixed', 'continuous', 'floating', 'planar'].includes(joint.jointType);
      if (limited && !joint.mimicJoint && !driven.has(joint.urdfName)) joint.setJointValue(Math.min(Math.max(0, joint.limit.lower), joint.limit.upper));
    }
    for (const {robot: carrier, palm} of this.grippers) {
      if (carrier !== index || palm < 0) continue;
      for (const name of (this.description.components[palm].mesh_uri.split('#')[1] ?? '').split('+'))
        for (const part of model.links?.[name]?.children ?? []) if (part.isURDFVisual) part.visible = false;
    }
  }

  // What carries a robot is no part of a cell: a column from the floor up to the base of one that stands above it. Robots that
  // hang, and slides, are carried in other ways.
  stand({name, joints: [first], base: {position: {x, y, z}, rotation}}) {
    if (!(z > 0) || rotation.zz < 0.9 || first?.type !== JointType.revolute) return;
    const column = new THREE.Mesh(new THREE.BoxGeometry(0.22, 0.22, z).translate(x, y, 0.5 * z), new THREE.MeshStandardMaterial({color: 0x737578, roughness: 0.7}));
    column.castShadow = column.receiveShadow = true;
    column.userData.chosen = {kind: 'robot', name};
    this.world.add(column);
  }

  // One material for all that is drawn of robots, in the colour that it has, with the section; with a graphics card,
  // edges are broken.
  dress(model) {
    const planes = this.section ? [this.plane] : [];
    model.traverse((part) => {
      if (!part.isMesh) return;
      if (!this.soft) breakEdges(part);
      part.castShadow = part.receiveShadow = true;
      const [material] = [part.material].flat();
      part.material = new THREE.MeshStandardMaterial({color: material?.color ?? 0xb8c0c8, map: material?.map ?? null, vertexColors: Boolean(material?.vertexColors), roughness: 0.6, side: THREE.DoubleSide, clippingPlanes: planes});
      this.turn(part);
    });
  }

  // Where the processor draws, backs that are never seen are left out: a section shows those of a solid.
  turn(mesh) {
    const {material, userData} = mesh;
    if (!this.soft) return;
    userData.solid ??= isSolid(mesh.geometry);
    const side = !this.section && userData.solid ? THREE.FrontSide : THREE.DoubleSide;
    if (material.side !== side) Object.assign(material, {side, shadowSide: side, needsUpdate: true});
  }

  // A mesh file that a URDF names, where takt view has it (--files); the link stays without it else.
  loadMesh(name, manager, done) {
    const kind = name.split('.').at(-1).toLowerCase(), loader = {stl: STLLoader, dae: ColladaLoader, obj: OBJLoader}[kind];
    const missing = () => { this.missing.add(name.replace(/^package:/, 'package://')); this.onMissing?.([...this.missing]); };
    if (!this.files || !loader) { missing(); done(new THREE.Group()); return; }
    const [where, path] = name.startsWith('package:') ? ['package', name.slice(8)]
      : name.startsWith('model://') ? ['package', name.slice(8)] : name.startsWith('file://') ? ['absolute', name.slice(7)] : name.startsWith('/') ? ['absolute', name] : ['relative', name];
    const parts = path.split('/').filter((part) => part !== '').map((part) => (part === '..' ? '(up)' : encodeURIComponent(part)));
    new loader(manager).load(`files/${where}/${parts.join('/')}`, (loaded) => {
      const model = kind === 'stl' ? new THREE.Mesh(loaded, new THREE.MeshPhongMaterial({color: 0xb8c0c8})) : (loaded.scene ?? loaded);
      done(model);  // gives it the material of the URDF
      this.dress(model);
      this.dirty = true;
      this.onGrown?.();
    }, undefined, () => { missing(); done(new THREE.Group()); });
  }

  show(state) {
    if (!this.description || state.components.length !== this.components.length) return;
    const {options} = this;
    const along = new THREE.Vector3();
    this.heat.take(state);
    this.weigh('parts', state.components.filter((sample, i) => this.components[i].type === ComponentType.part).map(({force}) => force));
    state.components.forEach((sample, i) => {
      const component = this.components[i];
      const {position: p, orientation: q, force: f} = sample;
      const last = component.mesh.position.clone();
      if (component.mesh.name !== this.held) component.mesh.position.set(p.x, p.y, p.z);
      component.mesh.visible = sample.state !== PartState.parked;
      if (component.mesh.name !== this.held) component.mesh.quaternion.set(q.x, q.y, q.z, q.w);
      if (options.follow === component.mesh.name && this.shown) {
        const moved = component.mesh.position.clone().sub(last);
        this.camera.position.add(moved);
        this.orbit.target.add(moved);
      }
      const tint = options.byState ? STATE_COLORS[sample.state] : undefined;
      component.mesh.material.color.copy(component.own);
      const heat = options.byTemperature ? this.heat.at(state, i) : null;
      if (heat !== null) component.mesh.material.color.lerp(this.heat.color(heat, STATE), HEAT);
      else if (tint !== undefined) component.mesh.material.color.lerp(STATE.set(tint), TINT);
      component.arrow.userData.says = () => `force on ${component.mesh.name}: ${Math.hypot(f.x, f.y, f.z).toPrecision(4)} N`;
      component.arrow.material.color.copy(this.forceColor(f, FORCE));
      component.arrow.set(component.mesh.position, along.set(f.x, f.y, f.z).multiplyScalar(options.forces && component.type === ComponentType.part ? options.metresPerNewton : 0));
      const holder = options.holding && sample.partner >= 0 ? state.components[sample.partner].position : null;
      component.line.visible = Boolean(holder);
      if (holder) {
        component.line.geometry.attributes.position.setXYZ(0, p.x, p.y, p.z);
        component.line.geometry.attributes.position.setXYZ(1, holder.x, holder.y, holder.z);
        component.line.geometry.attributes.position.needsUpdate = true;
      }
    });
    if (options.byState)
      state.grippers.forEach((gripper, i) => {
        const {left_jaw: left, right_jaw: right} = this.grippers[i];
        for (const jaw of [left, right]) this.components[jaw]?.mesh.material.color.set(gripper.part >= 0 ? GRIPS : gripper.closed ? CLOSED : OPEN);
      });
    state.robots.forEach((robot, i) => {
      const {model, base, ground, mount, joints} = this.robots[i];
      if (ground >= 0) {
        const {position, quaternion} = this.components[ground].mesh;
        base.matrix.compose(position, quaternion, new THREE.Vector3(1, 1, 1)).multiply(mount);
        base.matrixWorldNeedsUpdate = true;
      }
      joints.forEach((name, k) => model.setJointValue?.(name, robot.position[k]));
    });
    this.mark?.update();
    this.shown = true;
    this.dirty = true;
  }

  // The scale of forces has the largest one of Parts and contacts.
  weigh(of, forces) {
    this.largest[of] = Math.max(0, ...forces.map(({x, y, z}) => Math.hypot(x, y, z)));
    this.scales.force.take(Math.max(this.largest.parts, this.largest.contacts));
  }
  forceColor({x, y, z}, otherwise) { return this.options.byForce ? this.scales.force.color(Math.hypot(x, y, z), STATE) : STATE.set(otherwise); }

  // A disc of the pair's area, its colour by the largest pressure, and the force at its centre.
  showContacts({contacts}) {
    const wanted = this.options.contacts ? contacts : [];
    while (this.patches.length < wanted.length) {
      const disc = new THREE.Mesh(DISC, new THREE.MeshBasicMaterial({side: THREE.DoubleSide, transparent: true, opacity: 0.85, depthTest: false}));
      const arrow = new Arrow(CONTACT);
      this.marks.add(disc, arrow);
      this.patches.push({disc, arrow});
    }
    const {pressure} = this.scales;
    pressure.take(Math.max(0, ...wanted.map((contact) => contact.largest_pressure)));
    this.weigh('contacts', wanted.map(({force}) => force));
    this.patches.forEach(({disc, arrow}, i) => {
      const contact = wanted[i];
      disc.visible = Boolean(contact) && !this.pressed.has(`${contact.base}-${contact.target}`);
      arrow.visible = false;
      if (!contact) return;
      const {center_of_pressure: c, force: f} = contact;
      const force = new THREE.Vector3(f.x, f.y, f.z), named = (index) => this.components[index]?.mesh.name;
      disc.userData.says = arrow.userData.says = () => `${named(contact.base)} - ${named(contact.target)}\nforce ${force.length().toPrecision(4)} N\narea ${(1e6 * contact.area).toPrecision(3)} mm²\nlargest pressure ${(contact.largest_pressure / 1e6).toPrecision(3)} MPa`;
      disc.position.set(c.x, c.y, c.z);
      if (force.length() > 0) disc.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), force.clone().normalize());
      disc.scale.setScalar(Math.max(Math.sqrt(contact.area / Math.PI), 0.002));
      if (contact.largest_pressure > 0) pressure.color(contact.largest_pressure, disc.material.color); else disc.material.color.set(CONTACT);
      arrow.material.color.copy(this.forceColor(f, CONTACT));
      arrow.set(disc.position, force.multiplyScalar(this.options.metresPerNewton));
    });
    this.dirty = true;
  }

  // Elements that press, each in the colour of its pressure: in the frame of the component that they belong to.
  // Pairs without any are taken away, as is their disc where elements are shown instead.
  showPressures({pairs}) {
    const shown = new Set();
    for (const {base, target, corners, pressures, largest_pressure: largest} of pairs) {
      const component = this.components[base];
      if (!component || !pressures.length) continue;
      const key = `${base}-${target}`;
      shown.add(key);
      let mesh = this.pressed.get(key);
      if (!mesh) {
        mesh = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({vertexColors: true, side: THREE.DoubleSide, depthTest: false, clippingPlanes: this.section ? [this.plane] : []}));
        mesh.renderOrder = 1;
        mesh.frustumCulled = false;
        component.mesh.add(mesh);
        this.pressed.set(key, mesh);
      }
      const colors = new Float32Array(9 * pressures.length), color = new THREE.Color();
      for (let i = 0; i < pressures.length; ++i) {
        PRESSURE.color(pressures[i] / largest, color);
        for (let k = 0; k < 3; ++k) color.toArray(colors, 9 * i + 3 * k);
      }
      mesh.geometry.dispose();
      mesh.geometry = new THREE.BufferGeometry();
      mesh.geometry.setAttribute('position', new THREE.BufferAttribute(Float32Array.from(corners), 3));
      mesh.geometry.setAttribute('color', new THREE.BufferAttribute(colors, 3));
    }
    for (const [key, mesh] of this.pressed)
      if (!shown.has(key)) {
        mesh.removeFromParent();
        mesh.geometry.dispose();
        this.pressed.delete(key);
      }
    this.dirty = true;
  }

  setSection(axis, at) {
    this.section = axis || '';
    this.cut = Number(at) || 0;
    this.plane.normal.set(axis === 'x' ? -1 : 0, axis === 'y' ? -1 : 0, axis === 'z' ? -1 : 0);
    this.plane.constant = this.cut;
    const planes = this.section ? [this.plane] : [];
    this.world.traverse((part) => { if (part.isMesh || part.isLineSegments) Object.assign(part.material, {clippingPlanes: planes, clipShadows: true}); if (part.userData.solid) this.turn(part); });
    this.cast = null;
    this.dirty = true;
  }

  // Where the scene graph has a component.
  place(name) {
    const component = this.components.find(({mesh}) => mesh.name === name);
    return component ? component.mesh.getWorldPosition(new THREE.Vector3()).toArray() : null;
  }

  view() {
    const round = (vector) => vector.toArray().map((value) => Number(value.toFixed(3)));
    return {camera: round(this.camera.position), target: round(this.orbit.target), section: this.section, cut: this.cut, options: this.options};
  }
  setView({camera, target, section, cut}) {
    if (camera) this.camera.position.fromArray(camera);
    if (target) this.orbit.target.fromArray(target);
    this.setSection(section, cut);
    this.orbit.update();
  }

  draw() {
    requestAnimationFrame(this.draw);
    const {clientWidth: width, clientHeight: height} = this.canvas;
    if (this.width !== width || this.height !== height) {
      Object.assign(this, {width, height, dirty: true});
      this.renderer.setSize(width, height, false);
      const deep = this.eye?.deep ?? this.camera;
      deep.aspect = width / Math.max(height, 1);
      deep.updateProjectionMatrix();
      this.onSize?.();
    }
    this.eye?.step();
    if (!this.dirty) { this.rests ??= performance.now(); return; }  // nothing is drawn while nothing moves
    this.dirty = false;
    this.frames = (this.frames || 0) + 1;
    this.orbit.update();
    const now = performance.now(), follows = this.later || now - (this.rests ?? now) < STANDS, full = this.stands || !follows || !this.quality.slow;
    const stale = this.shade(this.stands ? 0 : SHADE_PERIOD[this.soft ? 'soft' : 'hard']);
    Object.assign(this, {rests: null, stands: false});
    clearTimeout(this.later), this.later = null;
    if (!full || stale) this.later = setTimeout(() => { if (!this.dirty) this.later = null, this.stands = this.dirty = true; }, full ? SHADE_PERIOD.soft : STANDS);
    this.onDraw?.();
    this.quality.draw(this.scene, this.camera, full);
  }

  // Shadows are drawn again where something that casts one has moved, once the last ones have this age; true: not yet.
  shade(age) {
    this.scene.updateMatrixWorld();
    const cast = shadows(this.world), now = performance.now();
    if (this.cast?.length === cast.length && cast.every((value, i) => value === this.cast[i])) return false;
    if (this.cast && now - this.shaded < age) return true;
    Object.assign(this, {cast, shaded: now});
    this.renderer.shadowMap.needsUpdate = true;
    cover(this.floor, this.world, this.low - 0.002, this.sun, 0.01 + 0.005 * this.radius);
    return false;
  }

  // The picture, with its shadows, is that of the present state, in full.
  get settled() { return !this.dirty && !this.later; }

  picture() {
    this.quality.draw(this.scene, this.camera, true);
    return new Promise((resolve) => this.canvas.toBlob(resolve, 'image/png'));
  }
}
