import { describe, expect, it } from 'vitest';
import type { LinkMessage } from '../api/types';
import { healthOf, LinkHealth } from './health';

const told = (counters: Record<string, number>): LinkMessage => ({
  topic: 'link',
  state: 'connected',
  counters,
  host_time: 0,
});
const retries = (health: LinkHealth) => health.figures().find((figure) => figure.name === 'Retries');

describe('link health', () => {
  it('tells what is going on now from what once was', () => {
    const health = new LinkHealth();
    health.heard(told({ requests: 100, retries: 40 }), 0);
    health.heard(told({ requests: 200, retries: 43 }), 30);
    expect(retries(health)).toMatchObject({ total: 43, lately: 3 });
    health.heard(told({ requests: 300, retries: 43 }), 120);
    health.heard(told({ requests: 400, retries: 44 }), 121);
    expect(retries(health)).toMatchObject({ total: 44, lately: 1 });
  });

  it('begins anew with a new link', () => {
    const health = new LinkHealth();
    health.heard(told({ requests: 1000, retries: 40 }), 0);
    health.heard(told({ requests: 10, retries: 1 }), 1);
    expect(retries(health)).toMatchObject({ total: 1, lately: 0 });
  });

  it('has no round trip before the first', () => {
    const health = new LinkHealth();
    expect(health.roundTrip()).toBeNull();
    health.heard(told({ round_trip_p99_s: 0.004 }), 0);
    expect(health.roundTrip()).toBeCloseTo(4);
  });
});

describe('what is said of the link', () => {
  const after = (more: Record<string, number>) => {
    const health = new LinkHealth();
    health.heard(told({ requests: 100 }), 0);
    health.heard(told({ requests: 3100, ...more }), 60);
    return healthOf('connected', health.figures());
  };

  it('is healthy only while nothing is counted', () => {
    expect(after({})).toEqual({ tone: 'good', text: 'healthy', advice: '' });
    expect(after({ late: 300, retries: 2 })).toMatchObject({ tone: 'warn', text: 'late samples' });
    expect(after({ retries: 2 })).toMatchObject({ text: 'retries', advice: '' });
  });

  it('says what to do about samples that come late', () => {
    expect(after({ late: 300 }).advice).toMatch(/computer is busy, or the line is slow\. End other programs/);
  });

  it('is what the service says of one that is lost or not open', () => {
    expect(healthOf('lost', []).tone).toBe('bad');
    expect(healthOf('none', []).text).toBe('not open');
  });
});
