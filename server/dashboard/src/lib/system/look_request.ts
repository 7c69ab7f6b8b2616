/** What is asked of the service about itself, all at once. */

import { api, ask, here, Problem, readiness } from '../api';
import type { AuditEntry } from '../api';
import type { Seen } from './service_look.svelte';

/** Rows of the audit log that are shown. */
const AUDIT = 20;

/** The newest rows of the audit log; null for a caller who may not read it. */
async function newestAudit(): Promise<readonly AuditEntry[] | null> {
  try {
    return (await ask(api.GET('/api/v1/audit', { params: { query: { limit: AUDIT } } }))).items;
  } catch (error) {
    if (error instanceof Problem && error.status === 403) return null;
    throw error;
  }
}

export async function lookAtService(): Promise<Seen> {
  const path = here();
  const ofJobs = { path, query: { state: ['queued', 'running'] as ('queued' | 'running')[], limit: 50 } };
  const health = await readiness();
  const [notifies, audits] = ['notifications', 'audit'].map((plugIn) => plugIn in health.checks);
  const [system, jobs, audit, notifications] = await Promise.all([
    ask(api.GET('/api/v1/system')),
    ask(api.GET('/api/v1/robots/{robot}/jobs', { params: ofJobs })),
    audits ? newestAudit() : null,
    notifies ? ask(api.GET('/api/v1/notifications')) : null,
  ]);
  return {
    system,
    health,
    jobs: jobs.items,
    audit,
    destinations: notifications?.destinations ?? null,
  };
}
