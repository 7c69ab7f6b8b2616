import { describe, expect, it } from 'vitest';
import type { Job } from '../api/types';
import { byRole, isEnded, merged, toneOf } from './jobs';

const job = (id: string, state: Job['state'], submitted: string, kind = 'fit'): Job =>
  ({ id, state, submitted, request: { kind } }) as unknown as Job;

describe('jobs', () => {
  const loaded = [job('a', 'done', '2026-01-01'), job('b', 'queued', '2026-01-02')];

  it('are those that were loaded, as they were last heard of, the newest first', () => {
    const heard = new Map([
      ['b', job('b', 'running', '2026-01-02')],
      ['c', job('c', 'queued', '2026-01-03')],
      ['d', job('d', 'queued', '2026-01-03', 'diagnose')],
    ]);
    const all = merged(loaded, heard, ['fit', 'validate']);
    expect(all.map((one) => [one.id, one.state])).toEqual([
      ['c', 'queued'],
      ['b', 'running'],
      ['a', 'done'],
    ]);
  });

  it('that have ended do not run again because of an older message', () => {
    const all = merged(loaded, new Map([['a', job('a', 'running', '2026-01-01')]]), ['fit']);
    expect(all.find((one) => one.id === 'a')?.state).toBe('done');
  });

  it('have a sign for every state', () => {
    const states: Job['state'][] = ['queued', 'running', 'done', 'failed', 'cancelled', 'interrupted'];
    expect(states.map((state) => toneOf(job('a', state, '')))).toEqual([
      'quiet',
      'busy',
      'good',
      'bad',
      'warn',
      'bad',
    ]);
    expect(states.map((state) => isEnded(job('a', state, '')))).toEqual([
      false,
      false,
      true,
      true,
      true,
      true,
    ]);
  });

  it('name their traces by role', () => {
    const roles = new Map([
      ['x', 'fit'],
      ['y', 'judge'],
      ['z', 'none'],
    ] as const);
    expect(byRole(roles)).toEqual({ traces: ['x'], held_out: ['y'] });
  });
});
