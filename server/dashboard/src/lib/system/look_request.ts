/** What is asked of the service about itself, all at once. */

import { api, ask, here, readiness } from '../api';
import type { Seen } from './service_look.svelte';

/** Events that are shown. */
export const EVENTS = 30;

export async function lookAtService(): Promise<Seen> {
  const path = here();
  const ofJobs = { path, query: { state: ['queued', 'running'] as ('queued' | 'running')[], limit: 50 } };
  const [system, health, jobs, events] = await Promise.all([
    ask(api.GET('/api/v1/system')),
    readiness(),
    ask(api.GET('/api/v1/robots/{robot}/jobs', { params: ofJobs })),
    ask(api.GET('/api/v1/robots/{robot}/events', { params: { path, query: { limit: EVENTS } } })),
  ]);
  return { system, health, jobs: jobs.items, events: events.items };
}
