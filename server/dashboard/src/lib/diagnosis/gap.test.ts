import { describe, expect, it } from 'vitest';
import type { DiagnosisData } from '../api/types';
import { gapOf, goneText, ticksFromZero } from './gap';

const gap = {
  measure: 'closed-loop',
  joints: [1, 2],
  units: ['rad', 'rad'],
  noise: [0.1, 0.2],
  stages: [
    { name: 'as given', kind: 'given', effect: null, joints: [], fitted: [4, 5], held_out: [6, 7] },
    {
      name: '+ Coulomb friction, joint 2',
      kind: 'effect',
      effect: 'coulomb_friction',
      joints: [2],
      fitted: [3, 4],
      held_out: [null, 5],
    },
    {
      name: 'everything refitted',
      kind: 'refitted',
      effect: null,
      joints: [],
      fitted: [1, 1],
      held_out: [1, 2],
    },
  ],
  without: { fitted: [3, 3], held_out: [], numbers: [], text: 'Without the effect, …' },
};

describe('the gap, step by step', () => {
  it('goes from the model as given over every effect that was added to everything refitted', () => {
    const found = gapOf({ gap } as unknown as DiagnosisData);
    expect(found.stages.map((one) => one.name)).toEqual([
      'as given',
      '+ Coulomb friction, joint 2',
      'everything refitted',
    ]);
    expect(found.stages.map((one) => one.label)).toEqual(['given', '+1', 'all']);
    expect(found.without).toBe('Without the effect, …');
    expect(found.stages.map((one) => one.fit[0])).toEqual([4, 3, 1]);
    expect(found.stages.map((one) => one.held?.[0])).toEqual([6, null, 1]);
    expect(found.floor).toEqual([0.1, 0.2]);
  });

  it('has no held-out stages where nothing was held out', () => {
    const alone = { ...gap, stages: gap.stages.map((one) => ({ ...one, held_out: [] })) };
    expect(gapOf({ gap: alone } as unknown as DiagnosisData).stages.map((one) => one.held)).toEqual([
      null,
      null,
      null,
    ]);
  });

  it('is empty in an answer that is older than it', () => {
    expect(gapOf({ gap: null } as unknown as DiagnosisData).stages).toEqual([]);
  });

  it('tells how much of the excess is gone, never rounded up to all of it', () => {
    expect([0.5, 0.9996, 1.01].map(goneText)).toEqual(['50.0 %', '99.9 %', 'all']);
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
