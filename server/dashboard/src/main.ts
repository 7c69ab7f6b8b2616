import { askEarly } from './lib/live/asked';
import { keepShell } from './lib/shell';

askEarly();
keepShell();
// This program waits for nothing, so it may run before the page's own text has been read.
const load = (): void => void import('./app');
if (document.readyState === 'loading') addEventListener('DOMContentLoaded', load);
else load();
