import { svelte } from '@sveltejs/vite-plugin-svelte';
import { build, type Plugin, type Rolldown } from 'vite';
import { defineConfig } from 'vitest/config';

/**
 * Names the program of the page in its index, so that the browser fetches it together with the few lines that ask the
 * service for the first data; from these alone it would hear of it only when they run.
 */
function preloaded(program: string): Plugin {
  return {
    name: 'preloaded-program',
    transformIndexHtml: {
      order: 'post',
      handler(html, { bundle, chunk: entry, filename }) {
        if (!filename.endsWith('/index.html')) return [];
        const chunks = Object.values(bundle ?? {}).filter((one) => one.type === 'chunk');
        const main = chunks.find((one) => one.facadeModuleId?.endsWith(program));
        if (main === undefined) throw new Error(`no part of the page is made from ${program}`);
        const scripts = [main.fileName, ...main.imports].filter((name) => name !== entry?.fileName);
        const styles = [...(main.viteMetadata?.importedCss ?? [])];
        const font = Object.keys(bundle ?? {}).find((name) => name.includes('/inter-latin-wght'));
        const tags = [
          { rel: 'preload', as: 'font', crossorigin: true, href: `./${font}` },
          ...scripts.map((name) => ({ rel: 'modulepreload', crossorigin: true, href: `./${name}` })),
          ...styles.map((name) => ({ rel: 'stylesheet', crossorigin: true, href: `./${name}` })),
        ];
        return tags
          .filter(({ href }) => !html.includes(`"${href}"`))
          .map((attrs) => ({ tag: 'link', attrs, injectTo: 'head' as const }));
      },
    },
  };
}

/** Lists the files of packages that the page is made from: programs, styles, fonts. hatch_build.py adds their licences. */
function taken(fileName: string): Plugin {
  return {
    name: 'taken-files',
    generateBundle(_, bundle) {
      const styles = [...this.getModuleIds()].filter((id) => /\.css(\?|$)/.test(id));
      const parts = Object.values(bundle).flatMap((one) =>
        one.type === 'chunk' ? one.moduleIds : one.originalFileNames,
      );
      const files = [...parts, ...styles].flatMap((id) => /node_modules\/([^?]+)/.exec(id)?.[1] ?? []);
      this.emitFile({ type: 'asset', fileName, source: JSON.stringify([...new Set(files)].sort()) });
    },
  };
}

/** Writes the saved report's program as one file: its script and its styles stand in it. */
function offline(program: string, fileName: string): Plugin {
  return {
    name: 'offline-report',
    async generateBundle() {
      const made = (await build({
        configFile: false,
        plugins: [svelte()],
        logLevel: 'error',
        build: {
          write: false,
          target: 'es2022',
          lib: { entry: program, formats: ['iife'], name: 'report', cssFileName: 'report' },
        },
      })) as Rolldown.RolldownOutput[];
      const parts = made.flatMap((one) => one.output);
      const script = parts.flatMap((one) => (one.type === 'chunk' ? [one.code] : [])).join('\n');
      const style = parts.flatMap((one) => (one.type === 'asset' ? [String(one.source)] : [])).join('\n');
      const source = [
        '<!doctype html><html lang="en"><head><meta charset="utf-8" />',
        '<meta name="viewport" content="width=device-width, initial-scale=1" />',
        `<style>${style}</style></head><body><div id="app"></div>`,
        '<script id="data" type="application/json">{}</script>',
        `<script>${script.replaceAll('</script', '<\\/script')}</script></body></html>`,
      ].join('\n');
      this.emitFile({ type: 'asset', fileName, source });
    },
  };
}

/** `--mode gallery`: the page that shows every component in its states, for pictures that tests compare. */
export default defineConfig(({ mode }) => ({
  // Relative addresses: a proxy may serve the page below a path of its own.
  base: './',
  plugins: [
    svelte(),
    ...(mode === 'gallery'
      ? []
      : [preloaded('/src/app.ts'), taken('taken.json'), offline('src/report/main.ts', 'report.html')]),
  ],
  build: {
    target: 'es2022',
    // The page's policy allows fonts and pictures as files of its own, not inside style sheets.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    reportCompressedSize: false,
    // The reference of the API comes as one large program, which only its own page loads.
    chunkSizeWarningLimit: 2000,
    rolldownOptions: {
      input: mode === 'gallery' ? ['gallery.html'] : ['index.html', 'reference.html'],
      // Few files: each takes a turn of the six connections that a browser has, before anything is asked of the API.
      // `early` is what main.ts asks by, `base` what the reference of the API shares with the page.
      // Not the gallery's: its stand-in of a service has to come before all of it.
      output: {
        codeSplitting: mode === 'gallery' || {
          groups: [
            { name: 'early', test: /src\/lib\/live\/asked\.ts$|vite\/preload-helper/, priority: 2 },
            { name: 'base', test: /src\/lib\/theme\.svelte\.ts$/, priority: 1 },
            { name: 'page', test: /src\/App\.svelte$/ },
          ],
        },
      },
    },
  },
  test: { environment: 'node', include: ['src/**/*.test.ts'], isolate: false },
}));
