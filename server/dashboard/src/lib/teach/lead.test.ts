import { describe, expect, it } from 'vitest';
import type { Machine } from '../api/types';
import { canBeLed, jointsInWords, ledAtFirst } from './lead';

const machine = (sensors: readonly boolean[], modelled: readonly number[]): Machine =>
  ({ joints: sensors.map((has) => ({ sensor: has ? {} : null })), modelled_joints: modelled }) as never;

describe('joints led by hand', () => {
  it('are at first those that the machine file describes, and may be any that is measured', () => {
    const arm = machine([true, true, true, true, false, true], [1, 2, 3]);
    expect(ledAtFirst(arm)).toEqual([1, 2, 3]);
    expect(canBeLed(arm)).toEqual([1, 2, 3, 4, 6]);
  });

  it('are never such that the arm does not have or does not measure', () => {
    expect(ledAtFirst(machine([true, false], [1, 2]))).toEqual([1]);
    expect(ledAtFirst(machine([true], [1]))).toEqual([1]);
  });

  it('are told in words', () => {
    expect([[2], [1, 3], [1, 2], [1, 2, 3], [1, 2, 4], []].map(jointsInWords)).toEqual([
      'joint 2',
      'joints 1 and 3',
      'joints 1 and 2',
      'joints 1 to 3',
      'joints 1, 2 and 4',
      'the led joints',
    ]);
  });
});
