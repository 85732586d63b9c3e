// Programs of takt for a test, on a DDS domain of their own; all end with it.
import {spawn, execFileSync} from 'node:child_process';
import {readFileSync} from 'node:fs';

const bin = process.env.TAKT_BIN;
export const sources = process.env.TAKT_SOURCES;
export const scenario = `${sources}/config/scenarios/block_assembly.yaml`;
export const program = `${sources}/config/programs/block_assembly.lua`;

function freeDomain() {
  const used = readFileSync('/proc/net/udp', 'utf8');
  for (;;) {
    const domain = 1 + Math.floor(Math.random() * 99);
    const port = (7400 + 250 * domain).toString(16).toUpperCase().padStart(4, '0');
    if (!used.includes(`:${port} `)) return domain;
  }
}
process.env.TAKT_DOMAIN = String(freeDomain());
process.env.TAKT_CELL = 'web_test';

// For programs that look for the cell: on a loaded machine they find it late.
export const patient = ['--timeout', '300'];

const running = new Set(), started = [];
process.on('exit', (code) => {
  for (const child of running) if (child.pid) child.kill('SIGKILL');
  if (![0, 77].includes(code)) for (const {spawnargs, exitCode, text} of started) console.log(`${spawnargs.join(' ')}: ${exitCode ?? 'running'}\n${text.slice(-2000)}`);
});

// Starts a program; resolves when it has said the words (at once without).
export function start(name, args, words) {
  const child = spawn(`${bin}/${name}`, args, {stdio: ['ignore', 'pipe', 'pipe']});
  running.add(child);
  started.push(child);
  child.text = '';
  child.ended = new Promise((resolve) => child.on('exit', (code) => { running.delete(child); resolve(code); }));
  return new Promise((resolve, reject) => {
    const take = (data) => {
      child.text += data;
      if (words && child.text.includes(words)) resolve(child);
    };
    child.stdout.on('data', take);
    child.stderr.on('data', take);
    child.on('error', (error) => { running.delete(child); reject(error); });
    child.on('exit', (code) => reject(new Error(`${name} ended with ${code}: ${child.text}`)));
    if (!words) resolve(child);
  });
}

export async function stop(child) {
  child.kill('SIGTERM');
  return child.ended;
}

export const server = (...args) => start('takt-server', [scenario, '--cell', process.env.TAKT_CELL, ...args]);
export async function view(port = 0, ...args) {
  const child = await start('takt', ['--json', 'view', '--port', String(port), ...args], '\n');
  return {child, url: JSON.parse(child.text).url};
}
export const takt = (...args) => JSON.parse(execFileSync(`${bin}/takt`, ['--json', ...patient, ...args], {encoding: 'utf8'}));
