import { describe, expect, it } from 'vitest';
import { Problem } from '../api/problem';
import type { ProcessState } from '../api/types';
import { OLD_AFTER, ProcessSignals } from './process.svelte';

const gripper = (state: 'open' | 'closed'): ProcessState =>
  ({ gripper: state, outputs: [], inputs: [] }) as never;

/** A service whose answers come, and a clock that goes on, when the test says so. */
function slow() {
  const clock = { now: 0 };
  const answers: { tell: (state: ProcessState) => void; refuse: (problem: Problem) => void }[] = [];
  const request = (): Promise<ProcessState> =>
    new Promise((tell, refuse) => answers.push({ tell, refuse: refuse as (problem: Problem) => void }));
  const requests = { look: request, grip: request, set: request };
  return { answers, clock, process: new ProcessSignals(requests, () => clock.now) };
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

  it('are not looked at again while an answer is awaited', async () => {
    const { answers, process } = slow();
    const looked = process.look();
    await process.look();
    expect(answers).toHaveLength(1);
    answers[0]!.refuse(new Problem(409, 'arm-busy', 'the arm is busy: program'));
    await looked;
    void process.grip(true);
    await process.look();
    expect(answers).toHaveLength(2);
  });

  it('are old when no look has told anything since, by the moment they were asked for', async () => {
    const { answers, clock, process } = slow();
    expect(process.oldAt(100)).toBeNull();
    const looked = process.look();
    clock.now = 2;
    answers[0]!.tell(gripper('open'));
    await looked;
    expect([process.oldAt(OLD_AFTER), process.oldAt(OLD_AFTER + 1)]).toEqual([null, OLD_AFTER + 1]);
    clock.now = OLD_AFTER + 1;
    const again = process.look();
    answers[1]!.refuse(new Problem(409, 'arm-busy', 'the arm is busy: program'));
    await again;
    expect(process.oldAt(OLD_AFTER + 2)).toBe(OLD_AFTER + 2);
    const third = process.look();
    answers[2]!.tell(gripper('open'));
    await third;
    expect(process.oldAt(OLD_AFTER + 2)).toBeNull();
  });
});
