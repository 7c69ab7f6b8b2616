import { describe, expect, it } from 'vitest';
import { cronOf, fromNow, interval, localMoment, momentOf } from './when';

describe('intervals', () => {
  it('are told in their largest even unit', () => {
    expect([10, 90, 1800, 5400, 86400, 172800].map(interval)).toEqual([
      '10 s',
      '90 s',
      '30 min',
      '90 min',
      '1 d',
      '2 d',
    ]);
    expect(interval(0.5)).toBe('0.5 s');
  });
});

describe('moments', () => {
  it('go through a field of this time zone and back', () => {
    const moment = new Date(2026, 2, 4, 5, 6);
    expect(localMoment(moment)).toBe('2026-03-04T05:06');
    expect(momentOf(localMoment(moment))).toBe(moment.toISOString());
    expect(momentOf('')).toBeNull();
    expect(momentOf('soon')).toBeNull();
  });

  it('are told from now', () => {
    const now = Date.parse('2026-01-01T12:00:00Z');
    expect(fromNow('2026-01-01T12:00:00Z', now)).toBe('now');
    expect(fromNow('2026-01-01T12:05:10Z', now)).toBe('in 5 min');
    expect(fromNow('2026-01-01T09:59:00Z', now)).toBe('2 h ago');
    expect(fromNow('2026-01-05T12:00:00Z', now)).toMatch(/^on 05 Jan 2026, \d\d:00$/);
    expect(fromNow('2025-12-28T12:00:00Z', now)).toBe('4 d ago');
  });
});

it('times of a clock are written for cron', () => {
  expect(cronOf('02:05', [0, 1, 2, 3, 4, 5, 6])).toBe('5 2 * * *');
  expect(cronOf('22:00', [5, 1, 0])).toBe('0 22 * * 0,1,5');
});
