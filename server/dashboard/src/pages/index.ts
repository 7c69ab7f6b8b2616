/**
 * The pages: their place in the address, their names, and what is loaded when one is opened. To add a page, write
 * `pages/Name.svelte` and a line here.
 */

import type { Component } from 'svelte';
import Live from './Live.svelte';

export interface PageEntry {
  path: string;
  title: string;
  load: () => Promise<{ default: Component }> | { default: Component };
}

/** The page over all arms, of a service that has several. */
export const OVERVIEW: PageEntry = { path: 'arms', title: 'Arms', load: () => import('./Arms.svelte') };

/** The pages of one arm, and of the service. */
export const PAGES: readonly PageEntry[] = [
  { path: 'live', title: 'Live', load: () => ({ default: Live as Component }) },
  { path: 'experiments', title: 'Experiments', load: () => import('./Experiments.svelte') },
  { path: 'traces', title: 'Traces', load: () => import('./Traces.svelte') },
  { path: 'models', title: 'Models', load: () => import('./Models.svelte') },
  { path: 'diagnosis', title: 'Diagnosis', load: () => import('./Diagnosis.svelte') },
  { path: 'system', title: 'System', load: () => import('./System.svelte') },
];

/** The screen at the arm: a page without the header, since it has a Stop of its own. */
export const KIOSK: PageEntry = { path: 'kiosk', title: 'At the arm', load: () => import('./Kiosk.svelte') };
