import { describe, expect, it } from 'vitest';
import type { Experiment } from '../api';
import { endOf, standingOf, troubleOf, type Lists } from './followed';

const one = (id: string, state = 'queued') => ({ id, state }) as Experiment;
const nothing: Lists = { waiting: [], running: null, ended: [] };

describe('the run that was just sent', () => {
  it('has a place in the queue, behind the one that runs', () => {
    const waiting = [one('a'), one('b')];
    expect(standingOf('a', { ...nothing, waiting })).toMatchObject({ state: 'waiting', said: 'It is next.' });
    const behind = standingOf('b', { ...nothing, waiting, running: one('c', 'running') });
    expect(behind).toMatchObject({
      text: 'number 2 in the queue',
      said: 'It runs after the one that is running and one that waits.',
    });
  });

  it('runs, and ends as it ended', () => {
    expect(standingOf('a', { ...nothing, running: one('a', 'running') }).state).toBe('running');
    const ended = [one('a', 'failed')];
    expect(standingOf('a', { ...nothing, ended })).toMatchObject({
      state: 'ended',
      tone: 'bad',
      text: 'failed',
    });
  });

  it('was stopped where it has left a part of its trace, and cancelled where it has not', () => {
    const stopped = { ...one('a', 'cancelled'), outcome: 'stopped' } as Experiment;
    expect(standingOf('a', { ...nothing, ended: [stopped] })).toMatchObject({
      tone: 'warn',
      text: 'stopped',
    });
    expect(endOf(one('a', 'cancelled'))).toBe('cancelled');
  });

  it('is not known before the lists have been read', () => {
    expect(standingOf('a', nothing)).toMatchObject({ state: 'unknown', experiment: null });
  });
});

it('a run that failed is remembered until one succeeds, whatever was cancelled since', () => {
  const failed = one('a', 'failed');
  expect(troubleOf([one('c', 'cancelled'), failed, one('b', 'done')])).toBe(failed);
  expect(troubleOf([one('b', 'done'), failed])).toBeNull();
  expect(troubleOf([])).toBeNull();
});
