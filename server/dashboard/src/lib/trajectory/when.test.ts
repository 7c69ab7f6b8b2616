import { describe, expect, it } from 'vitest';
import { cronOf, fromNow, interval, localMoment, momentOf, ruleOf } from './when';

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
    expect(fromNow('2026-01-05T12:00:00Z', now)).toBe('in 4 d');
  });
});

describe('rules of the clock', () => {
  it('are written for cron and told in words', () => {
    const zone = 'Europe/London';
    const told = (cron: string): string => ruleOf({ every: null, cron, zone });
    expect(cronOf('02:05')).toBe('5 2 * * *');
    expect(cronOf('02:05', [0, 1, 2, 3, 4, 5, 6])).toBe('5 2 * * *');
    expect(told(cronOf('02:05'))).toBe('daily 02:05 (Europe/London)');
    expect(told(cronOf('22:00', [5, 1, 0]))).toBe('Mon, Fri, Sun 22:00 (Europe/London)');
    expect(told('0 2 1 * *')).toBe('0 2 1 * * (Europe/London)');
    expect(told('0 2 * * 1-5')).toBe('0 2 * * 1-5 (Europe/London)');
  });
});
