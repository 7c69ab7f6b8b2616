import { afterEach, beforeEach, expect, it, vi } from 'vitest';
import { notAnswered, Problem } from '../api/problem';
import type { ControlLease } from '../api/types';
import { AGAIN_AFTER, LeaseKeeper } from './lease';

const lease = (secret: string): ControlLease => ({ lease: secret, heartbeat_every: 1 }) as ControlLease;

let held: ControlLease | null;
let lost: Problem | null;
let asked: { lease: string; answer: (lease: ControlLease) => void; refuse: (why: unknown) => void }[];
let keeper: LeaseKeeper;

beforeEach(() => {
  vi.useFakeTimers();
  [held, lost, asked] = [null, null, []];
  keeper = new LeaseKeeper({
    renew: (lease) => new Promise((answer, refuse) => asked.push({ lease, answer, refuse })),
    after: (seconds, call) => {
      const timer = setTimeout(call, seconds * 1000);
      return () => clearTimeout(timer);
    },
    told: (lease) => {
      held = lease;
    },
    lost: (problem) => {
      lost = problem;
    },
  });
  keeper.keep(lease('one'));
});
afterEach(() => vi.useRealTimers());

const pass = (seconds: number): Promise<unknown> => vi.advanceTimersByTimeAsync(seconds * 1000);

it('is renewed before it lapses, again and again', async () => {
  for (let beat = 1; beat <= 3; beat += 1) {
    await pass(0.99);
    expect(asked).toHaveLength(beat);
    asked.at(-1)?.answer(lease('one'));
    await pass(0);
  }
  expect(held?.lease).toBe('one');
});

it('is not taken back by an answer that comes after it was given back', async () => {
  await pass(1);
  keeper.forget();
  asked[0]?.answer(lease('one'));
  await pass(60);
  expect(held).toBeNull();
  expect(asked).toHaveLength(1);
});

it('given back, is neither asked for again nor told lost when the answer is a refusal or none', async () => {
  for (const why of [notAnswered(), new Problem(409, 'no-control', 'it has lapsed')]) {
    keeper.keep(lease('one'));
    await pass(1);
    const count = asked.length;
    keeper.forget();
    asked.at(-1)?.refuse(why);
    await pass(60);
    expect([held, lost, asked.length]).toEqual([null, null, count]);
  }
});

it('leaves another lease alone, taken meanwhile', async () => {
  await pass(1);
  keeper.forget();
  keeper.keep(lease('two'));
  asked[0]?.answer(lease('one'));
  await pass(0);
  expect(held?.lease).toBe('two');
});

it('is tried again while nobody answers, and given up when it is refused', async () => {
  await pass(1);
  asked[0]?.refuse(notAnswered());
  await pass(AGAIN_AFTER);
  expect(asked).toHaveLength(2);
  expect(held?.lease).toBe('one');
  asked[1]?.refuse(new Problem(409, 'no-control', 'it has lapsed'));
  await pass(0);
  expect([held, lost?.detail]).toEqual([null, 'it has lapsed']);
});
