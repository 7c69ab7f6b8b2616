import { expect, it } from 'vitest';
import type { SampleMessage } from '../api/types';
import { postureOf } from './posture';

const sample = { joints: [3, 1, 2], position: [0.3, 0.1, 0.2], set_point: [3, 1, 2] } as SampleMessage;

it('has a value for every joint of the machine, in its order', () => {
  expect(postureOf(sample, 'position', 3)).toEqual([0.1, 0.2, 0.3]);
  expect(postureOf(sample, 'set_point', 2)).toEqual([1, 2]);
});

it('is not known where a joint is not, and not guessed', () => {
  expect(postureOf(sample, 'position', 4)).toBeNull();
  expect(postureOf(null, 'position', 3)).toBeNull();
});
