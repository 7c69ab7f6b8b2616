import { describe, expect, it } from 'vitest';
import type { Experiment, QueueStatus, RobotMessage, ServiceEvent } from '../api/types';
import { timeOfDay } from '../format';
import {
  endReason,
  eventText,
  newestEvents,
  timesText,
  together,
  withPauser,
  withStopper,
  withYou,
} from './events';

const event = (kind: string, at: string, actor: string | null = 'local'): ServiceEvent =>
  ({ kind, at, actor }) as ServiceEvent;
const numbered = (...numbers: number[]): ServiceEvent[] =>
  numbers.map((number) => ({ number }) as ServiceEvent);
const you = (name: string): string => (name === 'local' ? 'you' : name);
const NOON = '2026-11-30T12:00:00Z';
const LATER = '2026-11-30T12:00:09Z';

it('events are told once, the newest first, however they were learnt', () => {
  const told = numbered(9, 8, 7, 6);
  expect(newestEvents(told, numbered(7, 6, 5, 4), 5).map((one) => one.number)).toEqual([9, 8, 7, 6, 5]);
  expect(newestEvents([], numbered(2, 1), 5)).toHaveLength(2);
});

it('rows are by their times, and one press is one row, however often it was sent', () => {
  const rows = ['reset', 'stop', 'stop', 'stop'].map((kind, index) =>
    event(kind, `2026-11-30T12:00:0${index}Z`),
  );
  // One that counts repeats is told after those that came since the last of them.
  const groups = together([rows[0]!, rows[3]!, rows[2]!, rows[1]!], ({ kind }) => kind);
  expect(groups.map(({ row, all }) => [row, all.length])).toEqual([
    [rows[3], 3],
    [rows[0], 1],
  ]);
  expect(groups.map((one) => timesText(one, one.all.length))).toEqual([
    `, 3 times since ${timeOfDay(rows[1]!.at)}`,
    '',
  ]);
});

it('an event says what it is about where its kind is not shown', () => {
  const said = (kind: string, text: string): string => eventText({ kind, text });
  expect(said('queue', 'paused')).toBe('the queue was paused');
  expect(said('connection', 'connected')).toBe('the arm was connected');
  expect(said('stop', 'stopped by the board')).toBe('stopped by the board');
});

describe('who stopped the arm or paused the queue', () => {
  const stopped = { arm: 'stopped', cause: 'on request' } as RobotMessage;
  const paused = { paused: true, reason: 'prose', since: NOON } as QueueStatus;
  const stop = `you pressed STOP at ${timeOfDay(NOON)}`;

  it('is named alike at the arm and at the queue', () => {
    expect(withStopper(stopped, [event('stop', NOON)], you)?.cause).toBe(stop);
    expect(withPauser(paused, [event('stop', NOON)], you)?.reason).toBe(
      `${stop}: look at the arm, then resume the queue`,
    );
    expect(withPauser(paused, [event('queue', LATER, 'anna')], you)?.reason).toBe(
      `anna paused it at ${timeOfDay(LATER)}`,
    );
  });

  it('is not the reader where somebody else at the service’s computer pressed Stop', () => {
    const other = (name: string, stoppedAt?: string): string => (stoppedAt ? 'somebody' : you(name));
    expect(withStopper(stopped, [event('stop', NOON)], other)?.cause).toBe(
      `somebody pressed STOP at ${timeOfDay(NOON)}`,
    );
  });

  it('is who cancelled the experiment, where the service ended it', () => {
    const cause = 'by the service: the experiment was cancelled, or nobody had the control any more';
    const text = "cancelled: cancelled by somebody at the service's computer";
    const ended = { ...event('experiment', NOON, null), text };
    expect(withStopper({ ...stopped, cause }, [ended], you)?.cause).toBe('cancelled by you');
    expect(withStopper(stopped, [ended, event('stop', NOON)], you)?.cause).toBe(stop);
    expect(withYou('cancelled by anna', you)).toBe('cancelled by anna');
  });

  it('is why a run ended that went on then', () => {
    const run = { reason: 'on request', started: '2026-11-30T11:59:50Z', ended: LATER } as Experiment;
    expect(endReason(run, [event('stop', NOON)], you)).toBe(stop);
    expect(endReason({ ...run, ended: '2026-11-30T11:59:55Z' }, [event('stop', NOON)], you)).toBe(
      'on request',
    );
    expect(endReason({ ...run, reason: 'cancelled by local' }, [event('stop', NOON)], you)).toBe(
      'cancelled by you',
    );
  });

  it('is left to the service where nobody did through it', () => {
    expect(withStopper(stopped, [event('reset', LATER), event('stop', NOON)], you)).toBe(stopped);
    expect(withStopper({ ...stopped, arm: 'fault' }, [event('stop', NOON)], you)?.cause).toBe('on request');
    const resumedBefore = event('queue', '2026-11-30T11:59:59Z');
    expect(withPauser(paused, [event('queue', NOON, null), resumedBefore], you)).toBe(paused);
    const stoppedBefore = event('stop', '2026-11-30T11:59:57Z');
    expect(withPauser(paused, [resumedBefore, stoppedBefore], you)).toBe(paused);
  });
});
