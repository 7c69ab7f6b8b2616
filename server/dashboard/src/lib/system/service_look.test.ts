import { describe, expect, it } from 'vitest';
import { Problem } from '../api/problem';
import type { ServiceEvent } from '../api/types';
import { newestEvents, ServiceLook, type Seen } from './service_look.svelte';

const events = (...numbers: number[]): ServiceEvent[] =>
  numbers.map((number) => ({ number }) as ServiceEvent);

describe('the service as it was last seen', () => {
  it('stays while it cannot be asked, and says so', async () => {
    const seen = {} as Seen;
    const answers = [
      Promise.resolve(seen),
      Promise.reject(new Problem(0, 'no-answer', 'it does not answer')),
    ];
    const look = new ServiceLook(() => answers.shift()!);
    await look.look();
    await look.look();
    expect([look.seen, look.problem?.detail]).toEqual([seen, 'it does not answer']);
  });
});

describe('what happened', () => {
  it('is told once, the newest first, however it was learnt', () => {
    const told = events(9, 8, 7, 6);
    expect(newestEvents(told, events(7, 6, 5, 4), 5).map((one) => one.number)).toEqual([9, 8, 7, 6, 5]);
    expect(newestEvents([], events(2, 1), 5)).toHaveLength(2);
  });
});
