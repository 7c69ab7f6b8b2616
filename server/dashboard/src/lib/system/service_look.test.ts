import { describe, expect, it } from 'vitest';
import { Problem } from '../api/problem';
import { ServiceLook, type Seen } from './service_look.svelte';

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
