import {readFileSync, readdirSync} from 'node:fs';
import {defineConfig} from 'vite';

// The built page contains the licences of its packages.
function licences() {
  return {
    name: 'licences',
    generateBundle(options, bundle) {
      const folders = new Set();
      for (const chunk of Object.values(bundle))
        for (const id of chunk.moduleIds ?? []) {
          const found = id.replaceAll('\0', '').match(/^(.*\/node_modules\/(?:@[^/]+\/)?[^/]+)\//);
          if (found) folders.add(found[1]);
        }
      const text = [...folders].sort().map((folder) => {
        const {name, version, license} = JSON.parse(readFileSync(`${folder}/package.json`, 'utf8'));
        const file = readdirSync(folder).find((entry) => /^licen[cs]e/i.test(entry));
        return `${name} ${version}: ${license}\n\n${file ? readFileSync(`${folder}/${file}`, 'utf8') : ''}`;
      });
      this.emitFile({type: 'asset', fileName: 'licenses.txt', source: text.join(`\n${'-'.repeat(80)}\n`)});
    },
  };
}

// Built files go where takt looks for them; relative, so that they can be served from anywhere.
export default defineConfig({
  base: './',
  plugins: [licences()],
  build: {outDir: process.env.TAKT_PAGE_DIR || 'dist', emptyOutDir: true, chunkSizeWarningLimit: 2000},
});
