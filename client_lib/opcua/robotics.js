// The robots of a cell by OPC 40010-1 (OPC UA for Robotics, 1.02): a MotionDeviceSystem in the DeviceSet. A mandatory value
// that takt does not have is BadNotSupported.
import {DataType, StatusCodes, Variant} from './opcua.js';
import {JointType} from './messages.js';
import {NAMESPACE, REFRESH_MS, Source} from './cell_nodes.js';
import {euInformation, structure} from './units.js';

const DI = 'http://opcfoundation.org/UA/DI/', ROBOTICS = 'http://opcfoundation.org/UA/Robotics/';
const Category = {other: 0, articulated: 1, cartesian: 3};   // MotionDeviceCategoryEnumeration
const Profile = {rotary: 1, linear: 3};                      // AxisMotionProfileEnumeration
const degrees = (radians) => radians * 180 / Math.PI;

const text = (value) => new Variant({dataType: DataType.LocalizedText, value: {text: value}});
const string = (value) => new Variant({dataType: DataType.String, value});
const number = (value) => new Variant({dataType: DataType.Int32, value});

function categoryOf(joints) {
  if (joints.every(({type}) => type === JointType.revolute)) return Category.articulated;
  return joints.every(({type}) => type === JointType.prismatic) ? Category.cartesian : Category.other;
}

// Safety devices of the cell: those of `state`, by the names of their signals.
function safetyOf(description) {
  const places = description.devices.flatMap(({type, signals}, d) => (type === 'safety' ? [{d, at: (name) => signals.findIndex((one) => one.name === name)}] : []));
  return (state) => places.map(({d, at}) => Object.fromEntries(['emergency_stop', 'released', 'speed'].map((name) => [name, state.devices[d].signals[at(name)]])));
}

export class RoboticsNodes {
  constructor(addressSpace, cell) {
    Object.assign(this, {addressSpace, cell, sources: [], refreshed: 0});
    this.namespace = addressSpace.getNamespace(NAMESPACE);
    this.robotics = addressSpace.getNamespaceIndex(ROBOTICS);
    this.deviceSet = addressSpace.rootFolder.objects.deviceSet;
  }

  type(name, uri = ROBOTICS) { return this.addressSpace.findObjectType(name, this.addressSpace.getNamespaceIndex(uri)); }
  make(type, parent, name, optionals = []) {
    return type.instantiate({browseName: {name, namespaceIndex: this.namespace.index}, componentOf: parent, namespace: this.namespace, optionals});
  }
  child(node, ...path) {
    return path.reduce((at, name) => at.getAggregates().find(({browseName}) => browseName.name === name), node);
  }
  put(node, path, variant) { this.child(node, ...path).setValueFromSource(variant, StatusCodes.Good); }
  unknown(node, ...path) {
    this.child(node, ...path).setValueFromSource({dataType: DataType.Null}, StatusCodes.BadNotSupported);
  }
  follow(node, path, dataType, read) {
    const source = new Source('state', this.child(node, ...path), dataType, read);
    this.sources.push(source);
    return source.variable;
  }
  identity(node, manufacturer, model, productCode, serialNumber) {
    for (const [name, value, make] of [['Manufacturer', manufacturer, text], ['Model', model, text], ['ProductCode', productCode, string], ['SerialNumber', serialNumber, string]]) {
      if (value === null) this.unknown(node, name);
      else this.put(node, [name], make(value));
    }
  }

  describe(description) {
    this.addressSpace.modelChangeTransaction(() => {
      if (this.system) this.addressSpace.deleteNode(this.system);
      this.sources = [];
      this.system = this.type('MotionDeviceSystemType').instantiate({
        browseName: {name: this.cell, namespaceIndex: this.namespace.index}, nodeId: 's=/robotics', componentOf: this.deviceSet, namespace: this.namespace,
      });
      const safety = safetyOf(description);
      const controller = this.addController(description.server_version);
      controller.addReference({referenceType: this.reference('HasSafetyStates'), nodeId: this.addSafety(safety).nodeId});
      for (const [r, robot] of description.robots.entries()) {
        const device = this.addMotionDevice(robot, r, safety);
        controller.addReference({referenceType: this.reference('Controls'), nodeId: device.nodeId});
      }
    });
  }

  reference(name) { return this.addressSpace.findReferenceType(name, this.robotics).nodeId; }

  addController(version) {
    const controller = this.make(this.type('ControllerType'), this.child(this.system, 'Controllers'), 'takt-server');
    this.identity(controller, 'takt', 'takt-server', version, null);
    this.unknown(controller, 'CurrentUser', 'Level');
    const software = this.make(this.type('SoftwareType', DI), this.child(controller, 'Software'), 'takt');
    this.put(software, ['Manufacturer'], text('takt'));
    this.put(software, ['Model'], text('takt-server'));
    this.put(software, ['SoftwareRevision'], string(version));
    const task = this.make(this.type('TaskControlType'), this.child(controller, 'TaskControls'), 'TaskControl');
    this.put(task, ['ComponentName'], text('programs of robots run outside of takt-server'));
    this.unknown(task, 'ParameterSet', 'TaskProgramName');
    this.unknown(task, 'ParameterSet', 'TaskProgramLoaded');
    return controller;
  }

  addSafety(safety) {
    const state = this.make(this.type('SafetyStateType'), this.child(this.system, 'SafetyStates'), 'SafetyState');
    this.unknown(state, 'ParameterSet', 'OperationalMode');
    this.follow(state, ['ParameterSet', 'EmergencyStop'], DataType.Boolean, (s) => safety(s).some((one) => one.emergency_stop !== 0));
    this.follow(state, ['ParameterSet', 'ProtectiveStop'], DataType.Boolean, (s) => safety(s).some((one) => one.released === 0 && one.emergency_stop === 0));
    return state;
  }

  addMotionDevice(robot, r, safety) {
    const device = this.make(this.type('MotionDeviceType'), this.child(this.system, 'MotionDevices'), robot.name);
    this.identity(device, null, robot.urdf.match(/<robot[^>]*\bname\s*=\s*["']([^"']*)/)?.[1] ?? null, null, null);
    this.put(device, ['MotionDeviceCategory'], number(categoryOf(robot.joints)));
    this.follow(device, ['ParameterSet', 'SpeedOverride'], DataType.Double, (s) => Math.min(100, ...safety(s).map(({speed}) => speed)));
    for (const [j, joint] of robot.joints.entries()) {
      const axis = this.addAxis(this.child(device, 'Axes'), joint, r, j);
      const train = this.make(this.type('PowerTrainType'), this.child(device, 'PowerTrains'), joint.name);
      const motor = this.make(this.type('MotorType'), train, 'Motor');
      this.identity(motor, null, null, null, null);
      this.setUnit(this.child(motor, 'ParameterSet', 'MotorTemperature'), 'degC');
      this.unknown(motor, 'ParameterSet', 'MotorTemperature');
      train.addReference({referenceType: this.reference('Moves'), nodeId: axis.nodeId});
    }
    return device;
  }

  addAxis(axes, joint, r, j) {
    const axis = this.make(this.type('AxisType'), axes, joint.name, ['ParameterSet.ActualSpeed']);
    const turns = joint.type === JointType.revolute;
    const shown = turns ? degrees : (value) => value;
    this.put(axis, ['MotionProfile'], number(turns ? Profile.rotary : Profile.linear));
    const add = (name, unit, range, read) => {
      const variable = this.follow(axis, ['ParameterSet', name], DataType.Double, (s) => shown(read(s.robots[r])));
      this.setUnit(variable, unit);
      if (range[0] < range[1])
        this.namespace.addVariable({
          propertyOf: variable, browseName: {name: 'EURange', namespaceIndex: 0}, typeDefinition: 'PropertyType', dataType: 'Range',
          accessLevel: 'CurrentRead', userAccessLevel: 'CurrentRead', value: structure(this.addressSpace, 'Range', {low: shown(range[0]), high: shown(range[1])}),
        });
    };
    add('ActualPosition', turns ? 'deg' : 'm', [joint.lower, joint.upper], ({position}) => position[j]);
    add('ActualSpeed', turns ? 'deg/s' : 'm/s', [-joint.max_velocity, joint.max_velocity], ({velocity}) => velocity[j]);
    return axis;
  }

  setUnit(variable, unit) { this.child(variable, 'EngineeringUnits').setValueFromSource(structure(this.addressSpace, 'EUInformation', euInformation(unit)), StatusCodes.Good); }

  update(state, time) {
    const all = time - this.refreshed >= REFRESH_MS;
    if (all) this.refreshed = time;
    for (const source of this.sources) source.take(state, time, all);
  }

  lose(time) { for (const source of this.sources) source.lose(time); }
}
