// The cell as OPC UA nodes: Objects/takt/<cell>/<owner>/<signal>, and the simulation with its methods. The identifier of a
// signal is its name, OWNER.SIGNAL; an owner has its own, other nodes begin with a slash, which no name has.
import {DataType, DataValue, StatusCodes, Variant, VariantArrayType} from './opcua.js';
import {Pace, SimulationState, nameOf} from './messages.js';
import {ownersOf} from './signals.js';
import {euInformation, structure} from './units.js';

export const NAMESPACE = 'urn:takt:cell';
const LARGEST_STEPS = 1000000000;  // of the request 'step'
export const REFRESH_MS = 500;     // of the time of values that stay the same

const statusOf = {
  lost: StatusCodes.BadNoCommunication, not_found: StatusCodes.BadNodeIdUnknown, incorrect_state: StatusCodes.BadInvalidState,
  refused: StatusCodes.BadInvalidState,
};

// What decides whether the nodes of two descriptions are the same.
export const shapeOf = (description) => JSON.stringify([ownersOf(description), description.robots.map(({name, urdf, joints}) => [name, urdf, joints.map(({max_velocity: v}) => v)])]);

// A variable whose value is read from the samples of one kind. `kept`: it keeps what was written until a reset.
export class Source {
  constructor(what, variable, dataType, read, kept = false) {
    Object.assign(this, {what, variable, dataType, read, kept, shown: undefined});
    this.set(new Variant({dataType: DataType.Null}), StatusCodes.BadWaitingForInitialData, new Date());
  }

  set(value, statusCode, time) {
    this.dataValue = new DataValue({value, statusCode, sourceTimestamp: time, serverTimestamp: time});
    this.variable.setValueFromSource(value, statusCode, time);
  }

  // `all`: with the time of the sample where the value is the same too.
  take(sample, time, all) {
    if (this.kept && this.shown !== undefined && this.epoch === sample.epoch) return;
    const value = this.read(sample);
    if (!all && value === this.shown) return;
    this.shown = value;
    this.epoch = sample.epoch;
    this.set(new Variant({dataType: this.dataType, arrayType: VariantArrayType.Scalar, value}), StatusCodes.Good, time);
  }

  // The last value, with a status that says so.
  lose(time) {
    this.shown = undefined;
    const {value, statusCode} = this.dataValue;
    if (statusCode.value === StatusCodes.Good.value) this.set(value, StatusCodes.UncertainLastUsableValue, time);
  }
}

export class CellNodes {
  constructor(addressSpace, cell, {observer, report}) {
    Object.assign(this, {cell, observer, report, sources: [], simulation: [], refreshed: {}});
    this.namespace = addressSpace.getNamespace(NAMESPACE);
    this.addressSpace = addressSpace;
    const folder = this.namespace.addFolder(addressSpace.rootFolder.objects, {browseName: 'takt', nodeId: 's=/takt'});
    // NodeVersion makes the server send GeneralModelChangeEvents for what is below.
    this.object = this.namespace.addObject({
      organizedBy: folder, browseName: cell.name, nodeId: 's=/cell', eventNotifier: 1, nodeVersion: '1',
    });
    this.enumerations = Object.fromEntries(Object.entries({SimulationState, Pace}).map(([name, values]) => [name, this.namespace.addEnumerationType({
      browseName: name, nodeId: `s=/types/${name}`,
      enumeration: Object.entries(values).map(([displayName, value]) => ({displayName, value})),
    })]));
    this.addSimulation();
  }

  variable(parent, nodeId, browseName, dataType, more = {}) {
    return this.namespace.addVariable({
      componentOf: parent, nodeId: `s=${nodeId}`, browseName, dataType, accessLevel: 'CurrentRead', userAccessLevel: 'CurrentRead',
      minimumSamplingInterval: 0, ...more,
    });
  }

  property(node, name, dataType, value) {
    return this.namespace.addVariable({
      propertyOf: node, nodeId: `s=${node.nodeId.value}/${name}`, browseName: {name, namespaceIndex: dataType === 'EUInformation' || dataType === 'Range' ? 0 : this.namespace.index},
      typeDefinition: 'PropertyType', dataType, accessLevel: 'CurrentRead', userAccessLevel: 'CurrentRead', minimumSamplingInterval: 0, value,
    });
  }

  addSimulation() {
    const parent = this.namespace.addObject({componentOf: this.object, nodeId: 's=/simulation', browseName: 'Simulation'});
    const add = (name, what, dataType, read, type = dataType) => {
      const source = new Source(what, this.variable(parent, `/simulation/${name}`, name, type), DataType[dataType], read);
      this.simulation.push(source);
      return source.variable;
    };
    const number = (name, what, unit, read) => this.addUnit(add(name, what, 'Double', read), unit);
    number('Time', 'state', 's', ({time}) => time);
    add('Steps', 'state', 'UInt64', ({step}) => [Number(step / 4294967296n), Number(step % 4294967296n)]);
    add('Epoch', 'state', 'UInt32', ({epoch}) => epoch);
    add('State', 'status', 'Int32', ({state}) => state, this.enumerations.SimulationState);
    add('Pace', 'status', 'Int32', ({pace}) => pace, this.enumerations.Pace);
    add('PaceFactor', 'status', 'Double', ({pace_factor: factor}) => factor);
    add('RealTimeFactor', 'status', 'Double', ({real_time_factor: factor}) => factor);
    add('Fault', 'status', 'String', ({fault}) => fault);
    add('Scenario', 'description', 'String', ({scenario}) => scenario);
    number('StepSize', 'description', 's', ({step_size: size}) => size);
    this.connected = this.variable(parent, '/simulation/Connected', 'Connected', 'Boolean');

    const argument = (name, dataType, text) => ({name, dataType, description: {text}});
    this.addMethod(parent, 'Step', [argument('Steps', DataType.UInt32, 'number of steps, at least 1')],
      [argument('Step', DataType.UInt64, 'steps since the last reset'), argument('Time', DataType.Double, 'simulated time, s')], async ([steps]) => {
        if (steps < 1 || steps > LARGEST_STEPS) return StatusCodes.BadOutOfRange;
        const {step, time} = await this.cell.step(steps);
        return [{dataType: DataType.UInt64, arrayType: VariantArrayType.Scalar, value: [Math.floor(step / 4294967296), step % 4294967296]}, {dataType: DataType.Double, value: time}];
      });
    this.addMethod(parent, 'SetState', [argument('State', this.enumerations.SimulationState.nodeId, '0 stopped, 1 playing, 2 paused')], [], async ([state]) => {
      if (![SimulationState.stopped, SimulationState.playing, SimulationState.paused].includes(state)) return StatusCodes.BadOutOfRange;
      await this.cell.setState(nameOf(SimulationState, state), state);
      return [];
    });
    this.addMethod(parent, 'Reset', [], [], async () => {
      await this.cell.reset();
      return [];
    });
    this.addMethod(parent, 'SetPace', [argument('Pace', this.enumerations.Pace.nodeId, '0 real time, 1 free, 2 lockstep'),
      argument('Factor', DataType.Double, 'simulated time over wall time, 0.001 to 1000, of the pace real time')], [], async ([pace, factor]) => {
      if (!Object.values(Pace).includes(pace) || !(factor >= 0.001 && factor <= 1000)) return StatusCodes.BadOutOfRange;
      await this.cell.setPace(nameOf(Pace, pace), pace, factor);
      return [];
    });
  }

  addMethod(parent, name, inputArguments, outputArguments, execute) {
    const method = this.namespace.addMethod(parent, {
      browseName: name, nodeId: `s=/simulation/${name}`, inputArguments, outputArguments, executable: !this.observer, userExecutable: !this.observer,
    });
    method.bindMethod(async (inputs, context) => {  // node-opcua counts the parameters
      if (this.observer) return {statusCode: StatusCodes.BadUserAccessDenied};
      try {
        const result = await execute(inputs.map(({value}) => value));
        return Array.isArray(result) ? {statusCode: StatusCodes.Good, outputArguments: result} : {statusCode: result};
      } catch (error) {
        this.report(`${name}: ${error.message}`);
        return {statusCode: statusOf[error.kind] ?? StatusCodes.BadInternalError};
      }
    });
  }

  addUnit(variable, unit) {
    this.property(variable, 'EngineeringUnits', 'EUInformation', structure(this.addressSpace, 'EUInformation', euInformation(unit)));
    return variable;
  }

  // The nodes of another description in place of those of the last one.
  describe(description) {
    this.addressSpace.modelChangeTransaction(() => {
      for (const owner of this.owners ?? []) this.addressSpace.deleteNode(owner);
      this.sources = [];
      this.owners = ownersOf(description).map((owner) => this.addOwner(owner));
    });
  }

  addOwner({name, kind, signals}) {
    const object = this.namespace.addObject({componentOf: this.object, nodeId: `s=${name}`, browseName: name, description: kind});
    for (const signal of signals) this.addSignal(object, name, signal);
    return object;
  }

  addSignal(owner, ownerName, signal) {
    const {name, type, unit, range, forced, wire} = signal;
    const full = `${ownerName}.${name}`;
    const writable = signal.input && !wire && !this.observer;
    const access = writable ? 'CurrentRead | CurrentWrite' : 'CurrentRead';
    const analog = type === 'Double' && (unit ? (range ? 'AnalogUnitRangeType' : 'AnalogUnitType') : range ? 'BaseAnalogType' : null);
    const variable = this.variable(owner, full, name, type, {accessLevel: access, userAccessLevel: access, ...(analog ? {typeDefinition: analog} : {})});
    if (unit) this.addUnit(variable, unit);
    if (range && type !== 'Boolean')
      this.property(variable, 'EURange', 'Range', structure(this.addressSpace, 'Range', {low: range[0], high: range[1]}));
    if (wire) this.property(variable, 'Wire', 'String', {dataType: DataType.String, value: wire});
    const source = new Source('state', variable, DataType[type], signal.read, signal.kept);
    this.sources.push(source);
    if (forced) this.sources.push(new Source('state', this.property(variable, 'Forced', 'Boolean'), DataType.Boolean, forced));
    if (writable) this.makeWritable(source, full, signal);
  }

  makeWritable(source, full, {range, read, forced, kept}) {
    const {variable} = source;
    variable.bindVariable({
      timestamped_get: () => new DataValue(source.dataValue),
      timestamped_set: async (dataValue) => {
        const {value} = dataValue.value, number = Number(value);
        if (dataValue.statusCode.value !== StatusCodes.Good.value) return StatusCodes.BadWriteNotSupported;  // a value that its writer calls bad
        if (Object(value) === value) return StatusCodes.BadTypeMismatch;  // an array
        if (!Number.isFinite(number) || (range && (number < range[0] || number > range[1]))) return StatusCodes.BadOutOfRange;
        try {
          // A forced input keeps its value.
          await this.cell.setInput(full, number, (state) => kept || forced(state) || read(state) === value);
          Object.assign(dataValue, {statusCode: StatusCodes.Good, sourceTimestamp: new Date()});
          source.dataValue = new DataValue(dataValue);
          if (!kept) source.shown = undefined;  // the next state counts
          return StatusCodes.Good;
        } catch (error) {
          this.report(`${full}: ${error.message}`);
          return statusOf[error.kind] ?? StatusCodes.BadInternalError;
        }
      },
    }, true);
  }

  // The values of a sample of the kind `what`.
  update(what, sample, time) {
    const all = time - (this.refreshed[what] ?? 0) >= REFRESH_MS;
    if (all) this.refreshed[what] = time;
    for (const list of [this.simulation, this.sources]) for (const source of list) if (source.what === what) source.take(sample, time, all);
  }

  setConnected(present, time) {
    this.connected.setValueFromSource({dataType: DataType.Boolean, value: present}, StatusCodes.Good, time);
    if (!present) for (const source of [...this.simulation, ...this.sources]) source.lose(time);
  }
}
