import { expect, it } from 'vitest';
import { counted, motionBegin, type Signals } from './columns';

const signals = (set_point: number[][] | null): Signals => ({
  joints: [1],
  samples: 4,
  time: [0, 1, 2, 3],
  position: [[0, 0, 0, 0.5]],
  set_point,
  error: null,
  drive: null,
});

it('a motion begins where the set point leaves its begin; without set points where the joint does', () => {
  expect(motionBegin(signals([[0.2, 0.2, 0.4, 0.4]]))).toBe(2);
  expect(motionBegin(signals(null))).toBe(3);
  expect(motionBegin(signals([[0.2, 0.2, 0.2, 0.2]]))).toBe(0);
});

it('time counts from there', () => {
  expect(counted(signals(null), 2).time).toEqual([-2, -1, 0, 1]);
});
