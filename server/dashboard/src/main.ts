import '@fontsource-variable/inter/wght.css';
import './app.css';
import { askEarly } from './lib/live/asked';
import { keepShell } from './lib/shell';

/** What is drawn without its styles is measured wrongly. This runs as soon as it is here, maybe before them. */
async function styles(): Promise<void> {
  if (document.readyState === 'loading')
    await new Promise((done) => addEventListener('DOMContentLoaded', done));
  const links = document.querySelectorAll<HTMLLinkElement>('link[rel=stylesheet]');
  await Promise.all(
    [...links].map((link) => link.sheet ?? new Promise((done) => (link.onload = link.onerror = done))),
  );
}

askEarly();
keepShell();
void Promise.all([import('./app'), styles()]).then(([{ begin }]) => begin());
