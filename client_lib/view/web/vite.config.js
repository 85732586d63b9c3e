import {defineConfig} from 'vite';

// Built files go where takt looks for them; relative, so that they can be served from anywhere.
export default defineConfig({
  base: './',
  build: {outDir: process.env.TAKT_PAGE_DIR || 'dist', emptyOutDir: true, chunkSizeWarningLimit: 2000},
});
