// node-opcua's client against takt-opcua: short forms of its services, and a walk that compares objects with their types.
import certificates from 'node-opcua-certificate-manager';
import client from 'node-opcua-client';

const {OPCUAClient, Variant} = client;
export const {AttributeIds, DataType, MessageSecurityMode, SecurityPolicy, StatusCodes, UserTokenType, constructEventFilter} = client;
export const {OPCUACertificateManager} = certificates;

const MANDATORY = 'i=78', MANDATORY_PLACEHOLDER = 'i=11510';
const FORWARD = 0, ALL_FIELDS = 63, OBJECT = 1, VARIABLE = 2;

export const later = () => new Promise((done) => setTimeout(done, 20));
// The test ends by its limit alone where this never comes.
export async function until(what, condition) {
  for (let tries = 0; !(await condition()); ++tries) {
    if (tries % 500 === 499) console.log(`still waiting: ${what}`);
    await later();
  }
}

// Names of the security policies that a server offers.
export async function policiesOf(url) {
  const connection = OPCUAClient.create({endpointMustExist: false, connectionStrategy: {maxRetry: 0}});
  await connection.connect(url);
  const endpoints = await connection.getEndpoints();
  await connection.disconnect();
  return endpoints.map(({securityPolicyUri}) => securityPolicyUri.replace(/.*#/, ''));
}

export async function connect(url, {user, ...options} = {}) {
  const connection = OPCUAClient.create({endpointMustExist: false, connectionStrategy: {maxRetry: 0}, ...options});
  await connection.connect(url);
  const session = await connection.createSession(user).catch(async (error) => {
    await connection.disconnect();
    throw error;
  });
  const namespaces = (await session.read({nodeId: 'i=2255', attributeId: AttributeIds.Value})).value.value;
  const ns = namespaces.indexOf('urn:takt:cell');
  const id = (name) => (/^(ns|i)=/.test(name) ? name : `ns=${ns};s=${name}`);
  const read = (name, attributeId = AttributeIds.Value) => session.read({nodeId: id(name), attributeId});
  return {
    session, namespaces, id, read,
    close: async () => { await session.close(); await connection.disconnect(); },
    value: async (name) => (await read(name)).value.value,
    status: async (name) => (await read(name)).statusCode.name,
    number: async (name) => { const [high, low] = (await read(name)).value.value; return 4294967296 * high + low; },
    // Names of the status codes of one Write request: {name: [dataType, value]}.
    write: async (values) => (await session.write(Object.entries(values).map(([name, [dataType, value]]) => ({
      nodeId: id(name), attributeId: AttributeIds.Value, value: {value: {dataType: DataType[dataType], value}},
    })))).map(({name}) => name),
    call: async (method, ...inputs) => {
      const result = await session.call({
        objectId: id('/simulation'), methodId: id(`/simulation/${method}`), inputArguments: inputs.map(([dataType, value]) => new Variant({dataType: DataType[dataType], value})),
      });
      return {status: result.statusCode.name, outputs: (result.outputArguments ?? []).map(({value}) => value)};
    },
    children: (nodeId, referenceTypeId = 'Aggregates') => browse(session, id(nodeId), referenceTypeId),
  };
}

async function browse(session, nodeId, referenceTypeId) {
  const {references} = await session.browse({nodeId, browseDirection: FORWARD, referenceTypeId, includeSubtypes: true, resultMask: ALL_FIELDS, nodeClassMask: 0});
  return references ?? [];
}

// Calls visit(path, status) for every mandatory variable that the type of an object, and the types of what it consists of, ask
// for; missing(path) where there is none.
export async function compareWithType(session, nodeId, path, visit, missing) {
  const [type] = await browse(session, nodeId, 'HasTypeDefinition');
  for (let at = type?.nodeId; at;) {
    await compareChildren(session, nodeId, at, path, visit, missing);
    const {references} = await session.browse({nodeId: at, browseDirection: 1, referenceTypeId: 'HasSubtype', includeSubtypes: true, resultMask: ALL_FIELDS});
    at = references?.[0]?.nodeId;
  }
  for (const child of await browse(session, nodeId, 'HasComponent')) if (child.nodeClass === OBJECT) await compareWithType(session, child.nodeId, `${path}/${child.browseName.name}`, visit, missing);
}

async function compareChildren(session, nodeId, declaration, path, visit, missing) {
  const there = await browse(session, nodeId, 'Aggregates');
  for (const wanted of await browse(session, declaration, 'Aggregates')) {
    const [rule] = await browse(session, wanted.nodeId, 'HasModellingRule');
    const name = `${path}/${wanted.browseName.name}`;
    if (rule?.nodeId.toString() === `ns=0;${MANDATORY_PLACEHOLDER}`) {
      const [type] = await browse(session, wanted.nodeId, 'HasTypeDefinition');
      if (!there.some((child) => child.typeDefinition.toString() === type.nodeId.toString())) missing(name);
    }
    if (rule?.nodeId.toString() !== `ns=0;${MANDATORY}`) continue;
    const found = there.find(({browseName}) => browseName.toString() === wanted.browseName.toString());
    if (!found) missing(name);
    else if (found.nodeClass === VARIABLE) visit(name, (await session.read({nodeId: found.nodeId, attributeId: AttributeIds.Value})).statusCode.name);
    if (found) await compareChildren(session, found.nodeId, wanted.nodeId, name, visit, missing);
  }
}
