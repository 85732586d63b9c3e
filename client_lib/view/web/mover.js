// Moves a selected Part by hand while the cell stands: handles in the picture, and the place goes to the cell when they are
// let go of.
import {TransformControls} from 'three/addons/controls/TransformControls.js';

export class Mover {
  // put({name, position, orientation}): to the cell. `strayed`: a Part may be drawn elsewhere than the cell's last state has it.
  constructor(cell, put) {
    Object.assign(this, {cell, put, mode: null, dragging: false, strayed: false});
    const handles = (this.handles = new TransformControls(cell.camera, cell.canvas));
    handles.setSpace('world');
    handles.size = 0.8;
    cell.scene.add((this.drawn = handles.getHelper()));
    handles.addEventListener('change', () => { cell.dirty = true; });
    handles.addEventListener('dragging-changed', ({value}) => {
      this.dragging = value;
      cell.orbit.enabled = !value;
      cell.held = value ? handles.object?.name : null;
      this.strayed = true;
      if (!value && handles.object) this.send(handles.object);
    });
  }

  // The Part that has handles: mesh, or null. mode: translate, rotate or null.
  take(mesh, mode) {
    const {handles} = this;
    this.mode = mode;
    handles.camera = this.cell.camera;
    if (!mesh || !mode) {
      this.strayed ||= this.cell.held !== null;
      handles.detach();
      this.cell.held = null;
      this.cell.orbit.enabled = true;
    } else {
      handles.attach(mesh);
      handles.setMode(mode);
    }
    this.cell.dirty = true;
  }

  get over() { return this.mode !== null && this.handles.axis !== null; }

  // A step along an axis of the world, for keys: m or rad.
  nudge(axis, amount) {
    const {object} = this.handles;
    if (!object) return;
    if (this.mode === 'translate') object.position[axis] += amount;
    else object.rotateOnWorldAxis(object.position.clone().set(Number(axis === 'x'), Number(axis === 'y'), Number(axis === 'z')), amount);
    this.send(object);
  }

  send({name, position: {x, y, z}, quaternion: q}) { this.put({name, position: [x, y, z], orientation: [q.x, q.y, q.z, q.w]}); }
}
