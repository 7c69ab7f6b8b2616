import { describe, expect, it } from 'vitest';
import type { Signals } from '../traces/columns';
import { jointsThatStep } from './joints';

const time = [0, 0.02, 0.04, 0.06];
const signals: Signals = {
  joints: [1, 2, 4],
  samples: 4,
  time,
  position: [time, time, time],
  set_point: [
    [0, 1, 2, 2],
    [0, 1, -1, 0.5],
    [3, 3, 3, 3],
  ],
  error: null,
  drive: null,
};

describe('joints of a trace', () => {
  it('make a step where their set point goes one way; not where it swings or rests', () => {
    expect(jointsThatStep(signals)).toEqual([1]);
  });

  it('make none where no set point is known', () => {
    expect(jointsThatStep({ ...signals, set_point: null })).toEqual([]);
  });
});
