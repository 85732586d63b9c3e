import {defineConfig} from 'vite';
import {licencesOf} from './licences.js';

// The built page contains the licences of its packages.
function licences() {
  return {
    name: 'licences',
    generateBundle(options, bundle) {
      const files = Object.values(bundle).flatMap((chunk) => chunk.moduleIds ?? []);
      this.emitFile({type: 'asset', fileName: 'licenses.txt', source: licencesOf(files)});
    },
  };
}

// Built files go where takt looks for them; relative, so that they can be served from anywhere.
export default defineConfig({
  base: './',
  plugins: [licences()],
  build: {outDir: process.env.TAKT_PAGE_DIR || 'dist', emptyOutDir: true, chunkSizeWarningLimit: 2000},
});
