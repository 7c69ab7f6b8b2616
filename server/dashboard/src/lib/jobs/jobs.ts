/** What a list of jobs is made of. Pure. */

import type { Job } from '../api/types';

export type JobKind = Job['request']['kind'];
export type Tone = 'good' | 'warn' | 'bad' | 'quiet' | 'busy';

/** Jobs as they were loaded, with what was heard of them since; the newest first. */
export function merged(
  loaded: readonly Job[],
  heard: ReadonlyMap<string, Job>,
  kinds: readonly JobKind[],
): readonly Job[] {
  const found = new Map(loaded.map((job) => [job.id, job]));
  for (const job of heard.values()) {
    if (!kinds.includes(job.request.kind)) continue;
    const before = found.get(job.id);
    if (before === undefined || !isEnded(before) || isEnded(job)) found.set(job.id, job);
  }
  return [...found.values()].sort((one, other) => other.submitted.localeCompare(one.submitted));
}

/** Whether nothing more comes of it. */
export function isEnded(job: Job): boolean {
  return job.state !== 'queued' && job.state !== 'running';
}

/** A sign and a word for a job's state. */
export function toneOf(job: Job): Tone {
  switch (job.state) {
    case 'done':
      return 'good';
    case 'running':
      return 'busy';
    case 'queued':
      return 'quiet';
    case 'cancelled':
      return 'warn';
    default:
      return 'bad';
  }
}

/** What fills the form of a diagnosis as it was for a job. */
export function againQuery({ request }: Job): string {
  const held = 'held_out' in request ? request.held_out : [];
  return [...request.traces.map((one) => `trace=${one}`), ...held.map((one) => `hold=${one}`)].join('&');
}

/** How a trace is used by a request. */
export type Role = 'none' | 'fit' | 'judge';

/** Traces by their roles, in the order in which they are listed. */
export function byRole(roles: ReadonlyMap<string, Role>): { traces: string[]; held_out: string[] } {
  const of = (role: Role): string[] => [...roles].filter(([, own]) => own === role).map(([trace]) => trace);
  return { traces: of('fit'), held_out: of('judge') };
}
