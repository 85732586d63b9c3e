// The signals of a cell under their names, as `takt signals` lists them: what the description says of them, and their values
// in a state.
import {GripperSignal, JointType, SignalType} from './messages.js';

const bit = (bits, i) => ((bits >>> i) & 1) === 1;
const flag = (name, input = false) => ({name, type: 'Boolean', unit: '', input});

// Of GripperSignal: what it is, and its value in the state of a gripper. The state has no commands of grippers (`kept`): these
// begin with the present value.
const grippers = {
  close: [{...flag('close', true), kept: true}, ({closed}) => closed],
  set_width: [{name: 'set_width', type: 'Double', unit: 'm', input: true, kept: true}, ({width}) => width],
  closed: [flag('closed'), ({closed}) => closed],
  width: [{name: 'width', type: 'Double', unit: 'm'}, ({width}) => width],
  force: [{name: 'force', type: 'Double', unit: 'N'}, ({force}) => force],
  moving: [flag('moving'), ({moving}) => moving],
  in_position: [flag('in_position'), ({in_position: there}) => there],
  part_present: [flag('part_present'), ({part}) => part >= 0],
  part: [{name: 'part', type: 'Int32', unit: ''}, ({part}) => part],
};

// A value of a signal on the wire is a number.
const valueOf = {Boolean: (number) => number !== 0, Int32: (number) => Math.round(number), Double: (number) => number};
const typeOf = (type) => (type === SignalType.boolean ? 'Boolean' : type === SignalType.integer ? 'Int32' : 'Double');

// Owners with their signals: {name, kind, signals: [{name, type, unit, input, wire, range, read(state), forced(state)}]}.
export function ownersOf(description) {
  const owners = [];
  description.devices.forEach((device, d) => owners.push({
    name: device.name, kind: device.type, signals: device.signals.map((signal, i) => {
      const type = typeOf(signal.type);
      return {
        name: signal.name, type, unit: signal.unit, input: signal.commanded, wire: signal.wire,
        range: signal.lower < signal.upper ? [signal.lower, signal.upper] : null,
        read: (state) => valueOf[type](state.devices[d].signals[i]), forced: (state) => bit(state.devices[d].forced, i),
      };
    }),
  }));
  description.grippers.forEach((gripper, g) => owners.push({
    name: gripper.name, kind: 'gripper', signals: Object.entries(GripperSignal).map(([name, i]) => {
      const [signal, value] = grippers[name];
      return {
        ...signal, wire: '', range: signal.unit === 'm' ? [0, gripper.max_width] : null,
        read: (state) => value(state.grippers[g]), forced: (state) => bit(state.grippers[g].forced, i),
      };
    }),
  }));
  description.robots.forEach((robot, r) => owners.push({
    name: robot.name, kind: 'robot', signals: robot.joints.map((joint, j) => ({
      name: joint.name, type: 'Double', unit: joint.type === JointType.revolute ? 'rad' : 'm', input: false, wire: '',
      range: joint.lower < joint.upper ? [joint.lower, joint.upper] : null,
      read: (state) => state.robots[r].position[j], forced: null,
    })),
  }));
  return owners;
}
