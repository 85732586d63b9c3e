// takt-opcua: OPC UA server of a running cell.
import path from 'node:path';
import {parseArgs} from 'node:util';
import {fileURLToPath} from 'node:url';
import {execFileSync} from 'node:child_process';
import {Cell} from './cell.js';
import {CellNodes, NAMESPACE, shapeOf} from './cell_nodes.js';
import {isLoopback, makeServer, readUsers} from './endpoint.js';
import {RoboticsNodes} from './robotics.js';

const HELP = `OPC UA server for the signals of a takt cell, with its robots by OPC 40010-1.
Usage: takt-opcua [OPTIONS]

Options:
  -h,--help               print this help message and exit
  --version               version of takt
  --cell TEXT [cell]      name of the cell (environment: TAKT_CELL)
  --domain INT [0]        DDS domain (environment: TAKT_DOMAIN)
  --profiles FILE         Fast DDS profiles (XML)
  --profile TEXT          name of the profile in that file
  --secure TEXT           auto, or a directory with identity and permissions (environment: TAKT_SECURE)
  --port INT [4840]       TCP port; 0: any free one
  --address TEXT [127.0.0.1]
                          address to listen on; 0.0.0.0: every network, with certificates and users
  --observer              all clients may observe, none may control
  --users FILE            names and passwords, NAME:PASSWORD a line, mode 600
  --anonymous             users without a name beyond this machine too

Examples:
  takt-server config/scenarios/block_assembly.yaml & takt-opcua
  takt-opcua --address 0.0.0.0 --users users.txt

A PLC reads and writes OWNER.SIGNAL of the namespace ${NAMESPACE} (docs/plc.md).

Exit codes: 0 ended by a signal; 1 failed; 2 wrong usage.`;

class UsageError extends Error {}

function wholeNumber(name, text, most) {
  if (!/^\d+$/.test(text) || Number(text) > most) throw new UsageError(`--${name}: '${text}'; allowed is a whole number from 0 to ${most}`);
  return Number(text);
}

function readOptions() {
  let values;
  try {
    const text = {type: 'string'}, flag = {type: 'boolean', default: false};
    ({values} = parseArgs({options: {
      help: {type: 'boolean', short: 'h'}, version: flag, cell: text, domain: text, profiles: text, profile: text, secure: text,
      port: {type: 'string', default: '4840'}, address: {type: 'string', default: '127.0.0.1'}, observer: flag, users: text, anonymous: flag,
    }}));
  } catch (error) {
    throw new UsageError(error.message);
  }
  values.port = wholeNumber('port', values.port, 65535);
  if (values.domain !== undefined) wholeNumber('domain', values.domain, 232);
  if (!isLoopback(values.address) && !values.users && !values.anonymous && !values.help && !values.version)
    throw new UsageError(`--address ${values.address}: other machines reach it; --users FILE names the users, --anonymous admits each client with a trusted certificate`);
  return values;
}

function report(sentence) { console.error(`takt-opcua: ${sentence}`); }

async function run() {
  const options = readOptions();
  if (options.help) return console.log(HELP);
  const program = process.env.TAKT_PROGRAM ?? path.join(path.dirname(fileURLToPath(import.meta.url)), '../../../bin/takt');
  const version = execFileSync(program, ['--version'], {encoding: 'utf8'}).trim().replace(/^takt /, '');
  if (options.version) return console.log(`takt-opcua ${version}`);
  const users = options.users ? readUsers(options.users) : null;
  const name = options.cell ?? (process.env.TAKT_CELL || 'cell');
  const {server, addressSpace} = await makeServer({...options, users, name, version});
  addressSpace.registerNamespace(NAMESPACE);
  const passed = ['domain', 'profiles', 'profile', 'secure'].flatMap((one) => (options[one] === undefined ? [] : [`--${one}`, options[one]]));
  const cell = new Cell({program, options: passed, name, observer: options.observer});
  const nodes = new CellNodes(addressSpace, cell, {observer: options.observer, report}), robotics = new RoboticsNodes(addressSpace, name);

  let shape;
  cell.on('description', (description) => {
    const time = new Date();
    const next = shapeOf(description);
    if (next !== shape) {
      shape = next;
      nodes.describe(description);
      robotics.describe(description);
      report(`Cell '${name}': ${nodes.sources.length} values of ${nodes.owners.length} devices, grippers and robots.`);
    }
    nodes.update('description', description, time);
  });
  cell.on('state', (state) => {
    const time = new Date();
    nodes.update('state', state, time);
    robotics.update(state, time);
  });
  cell.on('status', (status) => nodes.update('status', status, new Date()));
  const connected = (present) => {
    const time = new Date();
    nodes.setConnected(present, time);
    if (!present) robotics.lose(time);
    report(present ? `Cell '${name}' answers.` : `Cell '${name}' does not answer; its values are the last ones.`);
  };
  cell.on('found', () => connected(true));
  cell.on('lost', () => connected(false));

  let end;
  const over = new Promise((resolve, reject) => {
    end = resolve;
    cell.on('ended', (why) => reject(new Error(why)));
  });
  over.catch(() => {});  // it may end before it is waited for
  for (const signal of ['SIGINT', 'SIGTERM']) process.on(signal, end);
  nodes.setConnected(false, new Date());
  try {
    await server.start().catch((error) => {
      throw new Error(`port ${options.port} of ${options.address} cannot be listened on (${error.message}); --port takes another one, 0 any free one`);
    });
    const {port} = server.endpoints[0];
    console.log(`Listens on opc.tcp://${options.address}:${port}${options.observer ? ' (observers)' : ''}    (Ctrl-C ends it)`);
    await over;
  } finally {
    cell.close();
    await server.shutdown(0);
  }
}

run().then(() => process.exit(0), (error) => {
  report(error.message);
  process.exit(error instanceof UsageError ? 2 : 1);
});
