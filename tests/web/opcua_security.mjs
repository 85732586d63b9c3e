// The clients that takt-opcua admits: those of this machine without a name; beyond it trusted certificates and users.
import {strict as assert} from 'node:assert';
import {chmodSync, existsSync, mkdirSync, readFileSync, readdirSync, renameSync, writeFileSync} from 'node:fs';
import net from 'node:net';
import {start, stop} from './processes.mjs';

const bin = process.env.TAKT_BIN, work = process.env.TAKT_WORK;
const skip = (why) => { console.log(`skipped: ${why}`); process.exit(77); };
if (!existsSync(`${bin}/../share/takt/opcua/takt-opcua.mjs`)) skip('npm could not be reached when takt was built');
// takt-opcua itself runs on Node.js 18: its packages are in one file.
const [major, minor] = process.versions.node.split('.').map(Number);
if (major < 20 || (major === 20 && minor < 19)) skip(`node-opcua's client needs Node.js 20.19; this is ${process.version}`);
process.env.XDG_CONFIG_HOME = `${work}/config`;
const {MessageSecurityMode, OPCUACertificateManager, SecurityPolicy, UserTokenType, connect, later, policiesOf, until} = await import('./opcua_client.mjs');

async function gateway(...more) {
  const child = await start('takt-opcua', ['--port', '0', ...more], 'Listens');
  return {child, url: `opc.tcp://127.0.0.1:${child.text.match(/Listens on opc\.tcp:\/\/[^:]*:(\d+)/)[1]}`};
}
// Exit code and words of one that does not start.
async function refused(...args) {
  const child = await start('takt-opcua', args);
  child.on('exit', () => {});
  return {code: await child.ended, text: child.text};
}
const reasonOf = (promise) => promise.then(() => 'accepted', (error) => error.message);

// --- wrong usage, each with what is allowed
for (const [args, words] of [
  [['--port', '70000'], 'from 0 to 65535'], [['--domain', 'x'], 'from 0 to 232'], [['--adress', '::1'], '--adress'], [['--address', '0.0.0.0'], '--users FILE'],
]) {
  const {code, text} = await refused(...args);
  assert.equal(code, 2, text);
  assert.ok(text.includes(words), text);
}
const users = `${work}/users.txt`;
writeFileSync(users, 'plc:one:two\n');
chmodSync(users, 0o644);
const readable = await refused('--users', users);
assert.equal(readable.code, 1);
assert.match(readable.text, /users\.txt: mode 644.*chmod 600/);
chmodSync(users, 0o600);
writeFileSync(users, 'plc\n');
assert.match((await refused('--users', users)).text, /users\.txt:1:.*NAME:PASSWORD/);
writeFileSync(users, 'plc:one:two\n');

// --- this machine: without a name, without encryption; a certificate that is not trusted is refused until it is
const local = await gateway();
assert.ok((await policiesOf(local.url)).includes('None'));
await (await connect(local.url)).close();
assert.equal(readFileSync(`/proc/net/tcp`, 'utf8').includes(`00000000:${Number(new URL(local.url).port).toString(16).toUpperCase()}`), false, 'it listens beyond this machine');
const pki = `${work}/config/takt/opcua/pki`;
const own = new OPCUACertificateManager({rootFolder: `${work}/client`, automaticallyAcceptUnknownCertificate: true});
await own.initialize();
const secure = {clientCertificateManager: own, securityMode: MessageSecurityMode.SignAndEncrypt, securityPolicy: SecurityPolicy.Basic256Sha256, applicationName: 'a PLC'};
assert.notEqual(await reasonOf(connect(local.url, secure)), 'accepted');
// What a person does: the certificate is moved, and the PLC connects later. An attempt before the server sees the file moves it
// back.
await until('the rejected certificate', () => readdirSync(`${pki}/rejected`).length > 0);
await until('the trusted certificate', async () => {
  for (const file of readdirSync(`${pki}/rejected`)) renameSync(`${pki}/rejected/${file}`, `${pki}/trusted/certs/${file}`);
  for (let i = 0; i < 100; ++i) await later();
  return (await reasonOf(connect(local.url, secure).then((session) => session.close()))) === 'accepted';
});

// --- a stranger's bytes end its own connection alone
for (const bytes of ['GET / HTTP/1.1\r\n\r\n', Buffer.from('HELF\xff\xff\xff\x7f', 'latin1'), Buffer.from('OPNF\x08\x00\x00\x00', 'latin1'), Buffer.alloc(100000, 0xff)]) {
  const socket = net.connect(Number(new URL(local.url).port), '127.0.0.1');
  socket.on('error', () => {});
  socket.write(bytes);
  await new Promise((closed) => socket.on('close', closed).resume());
}
await (await connect(local.url)).close();
assert.equal(await stop(local.child), 0);

// --- beyond this machine: no connection without a certificate, no session without a name
const open = await gateway('--address', '0.0.0.0', '--users', users);
const offered = await policiesOf(open.url);
assert.ok(offered.length > 0 && !offered.includes('None'), offered.join());
assert.notEqual(await reasonOf(connect(open.url)), 'accepted');
assert.notEqual(await reasonOf(connect(open.url, secure)), 'accepted', 'without a name');
const as = (userName, password) => connect(open.url, {...secure, user: {type: UserTokenType.UserName, userName, password}});
assert.notEqual(await reasonOf(as('plc', 'one')), 'accepted');
assert.notEqual(await reasonOf(as('other', '')), 'accepted');
await (await as('plc', 'one:two')).close();

// --- its bridge ends with it, also when it is killed
const children = readFileSync(`/proc/${open.child.pid}/task/${open.child.pid}/children`, 'utf8').trim().split(' ');
assert.equal(children.length, 1);
assert.match(readFileSync(`/proc/${children[0]}/cmdline`, 'utf8'), /view/);
open.child.kill('SIGKILL');
/// A container without an init process keeps it as a zombie.
const hasEnded = pid => {
  try {
    return /^State:\tZ/m.test(readFileSync(`/proc/${pid}/status`, 'utf8'));
  } catch {
    return true;
  }
};
await until('the end of the bridge', () => hasEnded(children[0]));
console.log('takt-opcua admits clients of this machine, and beyond it trusted clients with a name');
process.exit(0);
