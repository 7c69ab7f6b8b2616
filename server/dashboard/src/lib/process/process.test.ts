import { describe, expect, it } from 'vitest';
import { Problem } from '../api/problem';
import type { ProcessState } from '../api/types';
import { ProcessSignals } from './process.svelte';

const gripper = (state: 'open' | 'closed'): ProcessState =>
  ({ gripper: state, outputs: [], inputs: [] }) as never;

/** A service whose answers come when the test says so. */
function slow() {
  const answers: { tell: (state: ProcessState) => void; refuse: (problem: Problem) => void }[] = [];
  const request = (): Promise<ProcessState> =>
    new Promise((tell, refuse) => answers.push({ tell, refuse: refuse as (problem: Problem) => void }));
  return { answers, process: new ProcessSignals({ look: request, grip: request, set: request }) };
}

describe('process signals', () => {
  it('are those of the newest order, though an earlier look is answered after it', async () => {
    const { answers, process } = slow();
    const looked = process.look();
    const gripped = process.grip(true);
    answers[1]!.tell(gripper('closed'));
    await gripped;
    answers[0]!.tell(gripper('open'));
    await looked;
    expect(process.signals?.gripper).toBe('closed');
  });

  it('stay what they were where an order is refused, until they can be looked at again', async () => {
    const { answers, process } = slow();
    const looked = process.look();
    answers[0]!.tell(gripper('open'));
    await looked;
    const set = process.set(3, true);
    answers[1]!.refuse(new Problem(409, 'no-control', 'somebody else has the control'));
    await set;
    expect([process.signals?.gripper, process.problem?.detail]).toEqual([
      'open',
      'somebody else has the control',
    ]);
    const again = process.look();
    answers[2]!.tell(gripper('open'));
    await again;
    expect(process.problem).toBeNull();
  });
});
