// Makes one file of takt-opcua and its packages, with the specifications that it reads and the licences of all.
import {build} from 'esbuild';
import {copyFileSync, mkdirSync, writeFileSync} from 'node:fs';
import {licencesOf} from './licences.js';

// Packages in CommonJS ask for the modules of Node.js by require(); Node.js 18 does not have the global crypto.
const banner = `
import {createRequire as takt_create_require} from 'node:module';
import {dirname as takt_dirname} from 'node:path';
import {fileURLToPath as takt_path} from 'node:url';
import {webcrypto as takt_webcrypto} from 'node:crypto';
const require = takt_create_require(import.meta.url), __filename = takt_path(import.meta.url), __dirname = takt_dirname(__filename);
globalThis.crypto ??= takt_webcrypto;
`;
const out = process.env.TAKT_OPCUA_DIR || 'dist';
mkdirSync(out, {recursive: true});
const {metafile} = await build({
  entryPoints: ['main.js'], external: ['proper-lockfile'],  // of a lock that is not used
  bundle: true, platform: 'node', target: 'node18', format: 'esm', outfile: `${out}/takt-opcua.mjs`, metafile: true, logLevel: 'warning',
  banner: {js: banner},
});
for (const name of ['', '.Di', '.IA', '.Robotics']) copyFileSync(`node_modules/node-opcua-nodesets/nodesets/Opc.Ua${name}.NodeSet2.xml`, `${out}/Opc.Ua${name}.NodeSet2.xml`);
writeFileSync(`${out}/licenses.txt`, licencesOf(Object.keys(metafile.inputs)));
