// The OPC UA server program of a cell: its network endpoint, the clients that it admits, and its limits.
import {mkdirSync, readFileSync, statSync} from 'node:fs';
import {homedir} from 'node:os';
import path from 'node:path';
import {fileURLToPath} from 'node:url';
import {timingSafeEqual, createHash} from 'node:crypto';
import {MessageSecurityMode, OPCUACertificateManager, OPCUAServer, SecurityPolicy} from './opcua.js';

// Beside this file: the specifications whose types the server has.
const NODESETS = ['Opc.Ua.NodeSet2.xml', 'Opc.Ua.Di.NodeSet2.xml', 'Opc.Ua.IA.NodeSet2.xml', 'Opc.Ua.Robotics.NodeSet2.xml'];
const LIMITS = {
  connections: 50, sessions: 50, subscriptionsPerSession: 10, subscriptions: 200, monitoredItemsPerSubscription: 10000, monitoredItems: 100000,
  queue: 1000, nodes: 10000, browse: 1000, calls: 100, message_bytes: 4 << 20, chunk_bytes: 64 << 10,
};

export const isLoopback = (address) => address === 'localhost' || address === '::1' || /^127\.\d+\.\d+\.\d+$/.test(address);

// Names and passwords of a file that others cannot read: NAME:PASSWORD, one a line.
export function readUsers(file) {
  const {mode, uid} = statSync(file);
  if ((mode & 0o077) !== 0 || uid !== process.getuid())
    throw new Error(`${file}: mode ${(mode & 0o777).toString(8)}; passwords need a file of your own that others cannot read: chmod 600 ${file}`);
  const users = new Map();
  readFileSync(file, 'utf8').split('\n').forEach((line, i) => {
    if (!line.trim()) return;
    const at = line.indexOf(':');
    if (at < 1 || at === line.length - 1) throw new Error(`${file}:${i + 1}: '${line.slice(0, Math.max(at, 0))}' without a password; allowed is NAME:PASSWORD`);
    users.set(line.slice(0, at), line.slice(at + 1));
  });
  if (!users.size) throw new Error(`${file}: no user; a line is NAME:PASSWORD`);
  return users;
}

const digest = (word) => createHash('sha256').update(word).digest();
const equal = (a, b) => timingSafeEqual(digest(a), digest(b));

// Certificates and trusted clients: those of this user.
export function certificateFolder() {
  return path.join(process.env.XDG_CONFIG_HOME || path.join(homedir(), '.config'), 'takt', 'opcua');
}

// Resolves to the server, initialized and not yet started.
export async function makeServer({address, port, anonymous, users, name, version}) {
  const folder = certificateFolder();
  mkdirSync(folder, {recursive: true, mode: 0o700});
  const certificates = new OPCUACertificateManager({rootFolder: path.join(folder, 'pki'), automaticallyAcceptUnknownCertificate: false});
  await certificates.initialize();
  const local = isLoopback(address);
  const here = path.dirname(fileURLToPath(import.meta.url));
  const server = new OPCUAServer({
    host: address === 'localhost' ? '127.0.0.1' : address, port, hostname: local ? '127.0.0.1' : undefined,
    serverCertificateManager: certificates, userCertificateManager: certificates,
    nodeset_filename: NODESETS.map((file) => path.join(here, file)),
    serverInfo: {applicationUri: 'urn:takt:opcua', productUri: 'urn:takt', applicationName: {text: `takt ${name}`}},
    buildInfo: {productName: 'takt-opcua', productUri: 'urn:takt', manufacturerName: 'takt', softwareVersion: version, buildNumber: version},
    securityPolicies: [...(local ? [SecurityPolicy.None] : []), SecurityPolicy.Basic256Sha256, SecurityPolicy.Aes128_Sha256_RsaOaep, SecurityPolicy.Aes256_Sha256_RsaPss],
    securityModes: [...(local ? [MessageSecurityMode.None] : []), MessageSecurityMode.Sign, MessageSecurityMode.SignAndEncrypt],
    allowAnonymous: local || anonymous, registerServerMethod: 1,
    userManager: {isValidUser: (user, password) => users !== null && equal(users.get(user) ?? '', password) && users.has(user)},
    maxConnectionsPerEndpoint: LIMITS.connections,
    transportSettings: {
      adjustTransportLimits: () => ({
        receiveBufferSize: LIMITS.chunk_bytes, sendBufferSize: LIMITS.chunk_bytes, maxMessageSize: LIMITS.message_bytes, maxChunkCount: LIMITS.message_bytes / LIMITS.chunk_bytes,
      }),
    },
    serverCapabilities: {
      maxSessions: LIMITS.sessions, maxSubscriptions: LIMITS.subscriptions, maxSubscriptionsPerSession: LIMITS.subscriptionsPerSession,
      maxMonitoredItems: LIMITS.monitoredItems, maxMonitoredItemsPerSubscription: LIMITS.monitoredItemsPerSubscription, maxMonitoredItemsQueueSize: LIMITS.queue,
      operationLimits: {
        maxNodesPerRead: LIMITS.nodes, maxNodesPerWrite: LIMITS.nodes, maxNodesPerBrowse: LIMITS.browse, maxNodesPerMethodCall: LIMITS.calls,
        maxMonitoredItemsPerCall: LIMITS.nodes, maxNodesPerTranslateBrowsePathsToNodeIds: LIMITS.browse, maxNodesPerRegisterNodes: LIMITS.nodes,
      },
    },
  });
  await server.initialize();
  // All inputs of one Write request reach the cell together.
  const {addressSpaceAccessor: accessor, addressSpace} = server.engine;
  const writeOne = accessor.write.bind(accessor);
  accessor.write = async (context, nodes) => (await Promise.all(nodes.map((node) => writeOne(context, [node])))).flat();
  return {server, addressSpace};
}
