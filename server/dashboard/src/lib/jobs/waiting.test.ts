import { describe, expect, it } from 'vitest';
import type { Job } from '../api/types';
import { namedTraces, waitingWords } from './waiting';

const BEGUN = '2026-11-21T10:00:00Z';
const after = (seconds: number): number => Date.parse(BEGUN) + 1000 * seconds;
const name = (trace: string): string => `ramp ${trace}`;

function behind(kind: string, traces: string[], started: string | null, others: number): Job {
  return { waits_behind: { job: 'j', request: { kind, traces }, started, others } } as unknown as Job;
}

describe('what a job waits behind', () => {
  it('is told with its trace and how long it has been computed', () => {
    const job = behind('diagnose', ['a'], BEGUN, 0);
    expect(waitingWords(job, after(200), name)).toBe('waits behind: diagnosis of ramp a (3 min so far)');
    expect(waitingWords(job, after(12.4), name)).toContain('(12 s so far)');
    expect(waitingWords(job, after(-5), name)).toContain('(0 s so far)');
    expect(waitingWords(job, after(7260), name)).toContain('(2 h 01 min so far)');
    expect(namedTraces(job)).toEqual(['a']);
  });

  it('says how many come before, and no time of what has not begun', () => {
    const job = behind('fit', ['a', 'b'], null, 2);
    expect(waitingWords(job, after(0), name)).toBe('waits behind: fit of 2 traces, then 2 more');
    expect(namedTraces(job)).toEqual([]);
  });

  it('is a worker where nothing is known to come before', () => {
    expect(waitingWords({ waits_behind: null } as Job, 0, name)).toBe('waits for a worker');
  });
});
