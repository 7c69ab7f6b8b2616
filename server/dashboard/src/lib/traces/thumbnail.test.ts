import { expect, it } from 'vitest';
import type { Signals } from './columns';
import { thumbnailOf } from './thumbnail';

const signals = (position: number[][]): Signals => ({
  joints: [1, 2],
  samples: 3,
  time: [0, 1, 2],
  position,
  set_point: null,
  error: [
    [0, 0.2, 0.1],
    [0, 0, 0],
  ],
  drive: null,
});

it('a thumbnail has the joints that moved, from where they began, and the largest error', () => {
  const found = thumbnailOf(
    signals([
      [3, 3.5, 4],
      [1, 1.001, 1],
    ]),
    [1, 7],
  );
  expect(found.positions).toEqual([{ joint: 1, points: '0.0,22.0 50.0,12.0 100.0,2.0' }]);
  expect(found.error).toBe('0,10 0.0,10.0 50.0,1.0 100.0,5.5 100,10');
});

it('of a trace at rest no line is drawn, and nothing is divided by nothing', () => {
  const still = signals([
    [1, 1, 1],
    [2, 2, 2],
  ]);
  const found = thumbnailOf({ ...still, error: null }, []);
  expect(found.positions).toEqual([]);
  expect(found.error).not.toContain('NaN');
});
