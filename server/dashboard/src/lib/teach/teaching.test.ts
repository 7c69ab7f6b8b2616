import { describe, expect, it } from 'vitest';
import { Problem } from '../api/problem';
import type { Machine, TeachingStatus } from '../api/types';
import { Teaching, type TeachRequests } from './teaching.svelte';

const machine = {
  name: 'arm',
  joints: [{ sensor: {} }, { sensor: {} }, { sensor: {} }],
  modelled_joints: [1, 2],
};
const status = { activity: 'none', lines: [], result: '', problem: '', path: null } as TeachingStatus;
const path = { joints: [1], times: [0, 0.02], positions: [[0], [0.1]] };
const refused = (): Promise<never> => Promise.reject(new Problem(409, 'arm-busy', 'the arm is busy'));

function teaching(answers: Partial<TeachRequests>): Teaching {
  const well = (): Promise<TeachingStatus> => Promise.resolve(status);
  const kept = {
    list: () => Promise.resolve([]),
    load: (): Promise<never> => Promise.reject(new Error('there is none')),
    put: () => Promise.resolve({ name: 'taught', revision: 1 } as never),
    remove: () => Promise.resolve(),
  };
  const requests = { run: well, lead: well, finish: well, ...kept, ...answers };
  return new Teaching(machine as unknown as Machine, requests);
}

describe('teaching', () => {
  it('leads the joints that the machine file describes, or those that are chosen', async () => {
    const asked: (readonly number[])[] = [];
    const taught = teaching({ lead: (joints) => (asked.push(joints), Promise.resolve(status)) });
    await taught.lead();
    taught.choose(3);
    taught.choose(1);
    await taught.lead();
    expect(asked).toEqual([
      [1, 2],
      [2, 3],
    ]);
    expect(taught.led).toEqual([2, 3]);
  });

  it('keeps the path that was led, and nothing where it did not end', async () => {
    const answers = [refused(), Promise.resolve({ ...status, path })];
    const taught = teaching({ finish: () => answers.shift()! });
    await taught.lead();
    await taught.finish();
    expect([taught.instructions, taught.led, taught.problem?.detail]).toEqual([
      [],
      [1, 2],
      'the arm is busy',
    ]);
    await taught.finish();
    expect([taught.instructions, taught.led, taught.problem]).toEqual([
      [{ kind: 'path', path, rate: 1 }],
      [],
      null,
    ]);
  });

  it('keeps a path once, however often its end is asked for', async () => {
    const taught = teaching({ finish: () => Promise.resolve({ ...status, path }) });
    await taught.lead();
    const first = taught.finish();
    expect(taught.isEnding).toBe(true);
    await Promise.all([first, taught.finish()]);
    expect([taught.instructions, taught.isEnding]).toEqual([[{ kind: 'path', path, rate: 1 }], false]);
  });

  it('does not say that joints are led where that was refused', async () => {
    const taught = teaching({ lead: refused });
    await taught.lead();
    expect([taught.led, taught.problem?.status]).toEqual([[], 409]);
  });

  it('knows no led joints once leading has ended without it', async () => {
    const taught = teaching({});
    await taught.lead();
    taught.isNotLed();
    expect(taught.led).toEqual([]);
  });

  it('takes no program its last instruction: it is deleted as a whole', () => {
    const taught = teaching({});
    taught.keep({ kind: 'wait', duration: 1 });
    taught.takeAway(0);
    expect(taught.instructions).toHaveLength(1);
  });

  it('runs the instructions in the order in which they stand', async () => {
    const ran: unknown[] = [];
    const taught = teaching({ run: (program) => (ran.push(program), Promise.resolve(status)) });
    taught.keep({ kind: 'wait', duration: 1 });
    taught.keep({ kind: 'gripper', closed: true });
    taught.keep({ kind: 'wait', duration: 2 });
    taught.move(1, -1);
    taught.takeAway(2);
    taught.edit(0, { kind: 'gripper', closed: false });
    taught.programs.name = 'mine';
    await taught.run();
    expect(ran).toEqual([
      {
        version: 1,
        name: 'mine',
        machine: 'arm',
        notes: '',
        instructions: [
          { kind: 'gripper', closed: false },
          { kind: 'wait', duration: 1 },
        ],
      },
    ]);
  });
});
