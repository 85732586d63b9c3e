// The licences of packages from npm: of those that have these files, each once.
import {readFileSync, readdirSync} from 'node:fs';

export function licencesOf(files) {
  const folders = new Set(files.map((file) => file.replaceAll('\0', '').match(/^(.*node_modules\/(?:@[^/]+\/)?[^/]+)\//)?.[1]).filter(Boolean));
  return [...folders].sort().map((folder) => {
    const {name, version, license} = JSON.parse(readFileSync(`${folder}/package.json`, 'utf8'));
    const file = readdirSync(folder).find((entry) => /^licen[cs]e/i.test(entry));
    return `${name} ${version}: ${license}\n\n${file ? readFileSync(`${folder}/${file}`, 'utf8') : ''}`;
  }).join(`\n${'-'.repeat(80)}\n`);
}
