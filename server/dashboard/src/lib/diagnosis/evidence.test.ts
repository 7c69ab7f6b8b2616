import { describe, expect, it } from 'vitest';
import type { DiagnosisData, DiagnosisStep, TriedEffect } from '../api/types';
import { evidenceBars, turnOf, turnWithoutStep } from './evidence';
import { viewsOf } from './views';
import { listed } from './words';

const tried = (effect: string, joint: number, evidence: number, refitted = true): TriedEffect => ({
  effect,
  called: `${effect} ${joint}`,
  joints: joint === 0 ? [] : [joint],
  evidence,
  misfit: refitted ? 1.1 : null,
  refitted,
  parameters: {},
  evidence_held_out: null,
  needed: null,
});
const candidates = [
  tried('stribeck_friction', 2, 80),
  tried('coulomb_friction', 2, 100),
  tried('backlash', 2, -3),
  tried('base_tilt', 0, -8, false),
];
const step = (group: TriedEffect[]): DiagnosisStep =>
  ({
    effect: 'coulomb_friction',
    called: 'Coulomb friction, joint 2',
    not_a_finding: '',
    joints: [2],
    evidence: 100,
    adopted: true,
    candidates,
    group,
  }) as unknown as DiagnosisStep;

describe('candidates', () => {
  it('are ranked, with the named one marked and every one explained', () => {
    const bars = evidenceBars(turnOf(step([])), 10);
    expect(bars.map((one) => [one.name, one.width, one.chosen])).toEqual([
      ['coulomb_friction 2', 1, true],
      ['stribeck_friction 2', 0.8, false],
      ['backlash 2', 0, false],
      ['base_tilt 0', 0, false],
    ]);
    expect(bars.map((one) => one.reason)).toEqual([
      'leads every other effect by 20',
      'explains 20 less than the best',
      'explains less than its parameters cost',
      'estimated by a quick probe, not fitted',
    ]);
  });

  it('are ranked by what held-out traces say as well', () => {
    const turn = turnOf({ ...step([]), evidence_held_out: 30 });
    const other = { ...tried('gear_loss', 2, 90), evidence_held_out: 45 };
    const bars = evidenceBars({ ...turn, candidates: [candidates[1]!, other] }, 10);
    expect(bars.map((one) => [one.name, one.evidence])).toEqual([
      ['gear_loss 2', 135],
      ['coulomb_friction 2', 100],
    ]);
  });

  it('of a group are all marked', () => {
    const bars = evidenceBars(turnOf(step(candidates.slice(0, 2))), 3);
    expect(bars.map((one) => one.chosen)).toEqual([true, true, false]);
  });
});

describe('candidates that are not comparable', () => {
  it('come after those that were fitted, and set no scale', () => {
    const probed = tried('stiction', 1, 5000, false);
    const bars = evidenceBars(turnOf({ ...step([]), candidates: [probed, ...candidates] }), 4);
    expect(bars.map((one) => [one.name, one.width])).toEqual([
      ['coulomb_friction 2', 1],
      ['stribeck_friction 2', 0.8],
      ['backlash 2', 0],
      ['stiction 1', 1],
    ]);
  });
});

describe('an answer without a step', () => {
  const answer = (fields: object): DiagnosisData =>
    ({ steps: [], candidates: [], significant: 10, ...fields }) as unknown as DiagnosisData;

  it('shows how far its best candidates stay below what is needed', () => {
    const turn = turnWithoutStep(answer({ candidates: [tried('backlash', 2, 4), tried('stiction', 1, -2)] }));
    expect(turn === null ? [] : evidenceBars(turn, 9).map((one) => [one.width, one.reason])).toEqual([
      [0.4, 'below the 10 that are needed'],
      [0, 'explains less than its parameters cost'],
    ]);
  });

  it('has nothing to show where nothing was tried, or a step was taken', () => {
    expect(turnWithoutStep(answer({}))).toBeNull();
    expect(turnWithoutStep(answer({ steps: [step([])], candidates }))).toBeNull();
  });
});

describe('words', () => {
  it('make lists', () => {
    expect(listed(['a', 'b', 'c'])).toBe('a, b and c');
    expect(listed(['a'])).toBe('a');
  });
});

describe('maps of disagreement', () => {
  const where = (cells: object[]): never => ({ cells }) as never;

  it('are of the model as given and before every step, where there is a map', () => {
    const steps = [
      { ...step([]), where: where([{}]), chance: 3 },
      { ...step([]), effect: 'wrong_gain', where: where([]), chance: 3 },
    ];
    const views = viewsOf({ given: { where: where([{}]), chance: 4, not_a_finding: '' }, steps });
    expect(views.map((one) => [one.name, one.chance])).toEqual([
      ['the model as given', 4],
      ['tolerances fitted, before Coulomb friction, joint 2', 3],
    ]);
    expect(viewsOf({ given: null, steps }).map((one) => one.chance)).toEqual([3]);
  });
});
