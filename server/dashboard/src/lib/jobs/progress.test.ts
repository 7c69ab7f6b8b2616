import { expect, it } from 'vitest';
import { percentDone, progressOf } from './progress';

it('is never all of it while it runs', () => {
  expect([0, 0.254, 0.999, 1, 1.2, null].map(percentDone)).toEqual([0, 25, 99, 99, 99, 0]);
});

it('of an experiment goes on after its motion', () => {
  expect(progressOf({ fraction: 0.5, text: '1.6 of 3.2 s' })).toEqual({
    fraction: 0.5,
    percent: 50,
    text: '1.6 of 3.2 s',
  });
  expect(progressOf({ fraction: 1, text: '3.2 of 3.2 s' }).text).toBe('saving the trace');
});
