import { describe, expect, it } from 'vitest';
import type { DiagnosisData, DiagnosisStep, SignalError } from '../api/types';
import { gapOf, goneOf, ticksFromZero } from './gap';

const error = (before: number, after: number): SignalError => ({
  joint: 2,
  unit: 'rad',
  before,
  after,
  floor: 0.1,
});
const step = (effect: string, adopted: boolean, before: number, after: number): DiagnosisStep =>
  ({
    effect,
    called: effect,
    joints: [2],
    adopted,
    rmse_fit: [error(before, after)],
    rmse_holdout: [error(before * 1.1, after * 1.1)],
    where: { cells: [{}] },
  }) as unknown as DiagnosisStep;
const found = (steps: DiagnosisStep[], last: number): DiagnosisData =>
  ({
    steps,
    rmse_fit: [error(4, last)],
    rmse_holdout: [error(5, last)],
  }) as unknown as DiagnosisData;

describe('the gap, step by step', () => {
  it('goes from the model as given over its tolerances to every step', () => {
    const gap = gapOf(found([step('backlash', true, 3, 1), step('coulomb_friction', false, 1, 0.9)], 1));
    expect(gap.stages.map((one) => one.name)).toEqual([
      'as given',
      'tolerances fitted',
      '+ backlash',
      '+ coulomb_friction',
    ]);
    expect(gap.stages.map((one) => one.fit[0])).toEqual([4, 3, 1, 0.9]);
    expect(gap.stages.map((one) => one.kept)).toEqual([true, true, true, false]);
    expect(gap.stages[0]?.held).toEqual([5]);
    expect(gap.floor).toEqual([0.1]);
  });

  it('has two stages when nothing is missing', () => {
    const gap = gapOf(found([], 0.2));
    expect(gap.stages.map((one) => [one.name, one.fit[0]])).toEqual([
      ['as given', 4],
      ['tolerances fitted', 0.2],
    ]);
  });

  it('leaves out what the controller itself has proved: nothing was fitted for it', () => {
    const proof = { ...step('wrong_gain', true, 0, 0), where: { cells: [] } } as unknown as DiagnosisStep;
    expect(gapOf(found([proof], 0.2)).stages).toHaveLength(2);
  });

  it('tells how much of the excess is gone only where there was some', () => {
    expect(goneOf(1, 0.1, 0.1)).toBeCloseTo(1);
    expect(goneOf(1, 1, 0.1)).toBe(0);
    expect(goneOf(0.12, 0.1, 0.1)).toBeNull();
  });

  it('has an axis from 0, so that the height of the noise floor can be compared', () => {
    expect(ticksFromZero([0.03, 0.9])).toEqual([0, 0.5, 1]);
    expect(ticksFromZero([2.1])).toEqual([0, 1, 2, 3]);
    expect(ticksFromZero([0.021, 0.02])).toEqual([0, 0.01, 0.02, 0.03]);
    expect(ticksFromZero([])).toEqual([0, 1]);
    for (const most of [0.0123, 0.95, 1, 7.7, 333])
      expect(ticksFromZero([most]).at(-1)).toBeGreaterThan(most);
  });
});
