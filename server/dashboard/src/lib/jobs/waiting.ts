/** What a job waits behind, in words. Pure. */

import type { Job } from '../api/types';
import { coarse } from '../format';
import { JOB_NAMES } from '../lineage/tree';

/** Traces that are called by name; of more, how many. */
const MOST_NAMED = 1;

/**
 * `waits behind: diagnosis of ramp, 21 Nov 2026, 10:22:05 (3 min so far)`.
 *
 * `now` in ms since 1970; `name`: what a trace is called.
 */
export function waitingWords(job: Job, now: number, name: (trace: string) => string): string {
  const behind = job.waits_behind ?? null;
  if (behind === null) return 'waits for a worker';
  const { traces } = behind.request;
  const of = traces.length <= MOST_NAMED ? traces.map(name).join(', ') : `${traces.length} traces`;
  const more = behind.others === 0 ? '' : `, then ${behind.others} more`;
  return `waits behind: ${JOB_NAMES[behind.request.kind].toLowerCase()} of ${of}${soFar(behind.started, now)}${more}`;
}

/** Traces whose names the words need. */
export function namedTraces(job: Job): readonly string[] {
  const traces = job.waits_behind?.request.traces ?? [];
  return traces.length <= MOST_NAMED ? traces : [];
}

function soFar(started: string | null, now: number): string {
  if (started === null) return '';
  const seconds = Math.max(0, (now - Date.parse(started)) / 1000);
  return ` (${coarse(seconds)} so far)`;
}
