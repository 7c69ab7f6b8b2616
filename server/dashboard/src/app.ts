import { mount } from 'svelte';
import App from './App.svelte';
import { live } from './lib/live/live.svelte';

/** ms. */
const A_MOMENT = 100;

const target = document.getElementById('app');
if (target === null) throw new Error('index.html has no element with the id "app"');
// Drawn once where the service answers within a moment, and not first without what it shows.
await Promise.race([live.start(), new Promise((later) => setTimeout(later, A_MOMENT))]);
mount(App, { target });
