import { describe, expect, it } from 'vitest';
import type { Overlay } from '../api/types';
import { armsAt, driftOf, enlargementOf, heatAt } from './drift';
import { runnersOf } from './race';
import { bothNumbers, guessWords } from './words';

const TIME = Array.from({ length: 201 }, (_, index) => index * 0.05);
const overlay = (before: number, after: number): Overlay =>
  ({
    joints: [1, 2],
    time: TIME,
    measured: [TIME.map(() => 1), TIME.map(() => 2)],
    residual: [before, after].map((gap) => [TIME.map(() => 0), TIME.map(() => gap)]),
  }) as unknown as Overlay;

describe('a drift', () => {
  it('is enlarged by a round number, and closes with the second model', () => {
    const drift = driftOf(overlay(0.01, 0));
    expect(enlargementOf(drift)).toBe(20);
    expect(armsAt(drift, 5, 20, 0)).toEqual({ recorded: [1, 2], simulated: [1, 2 - 20 * 0.01] });
    expect(armsAt(drift, 5, 20, 1).simulated).toEqual([1, 2]);
  });

  it('heats the joint that differs by more than its noise, until the gap is closed', () => {
    const drift = driftOf(overlay(0.01, 0.001));
    expect(heatAt(drift, [0.001, 0.001], 5, 0)).toEqual([0, 1]);
    expect(heatAt(drift, [0.001, 0.001], 5, 1)).toEqual([0, 0]);
  });

  it('heats a joint whose difference trembles, although it is drawn where it is on average', () => {
    const still = overlay(0, 0);
    const drift = driftOf({
      ...still,
      residual: [[TIME.map(() => 0), TIME.map((_, index) => (index % 2 ? 0.01 : -0.01))]],
    } as unknown as Overlay);
    expect(heatAt(drift, [0.001, 0.001], 5, 0)).toEqual([0, 1]);
    expect(armsAt(drift, 5, 20, 0).simulated[1]).toBeCloseTo(2, 1);
  });

  it('of a record without a difference is not enlarged without end', () => {
    expect(enlargementOf(driftOf(overlay(0, 0)))).toBe(200);
  });
});

it('candidates that compete are those with something to say for them, the best first', () => {
  const one = (effect: string, evidence: number, fitted: boolean) => ({
    effect,
    joints: [2],
    called: `${effect} on joint 2`,
    evidence,
    fitted,
  });
  const runners = runnersOf([one('a', 10, false), one('b', 40, true), one('c', -3, true)]);
  expect(runners.map((runner) => [runner.called, runner.width, runner.leads])).toEqual([
    ['b on joint 2', 1, true],
    ['a on joint 2', 0.25, false],
  ]);
});

it('the two numbers stand in one unit, angles in degrees', () => {
  const number = { called: 'gap', unit: 'rad', hidden: 0.01, found: null, low: null, high: null };
  expect(bothNumbers(number)).toEqual({ hidden: '0.573 °', found: 'not in the answer', range: '' });
  expect(bothNumbers({ ...number, unit: 'N·m', found: 0.02, low: 0.01, high: 0.03 }).range).toBe(
    '95 %: 0.0100 to 0.0300 N·m',
  );
});

it('judges a guess by effect and joint', () => {
  const secret = { effect: 'stiction', joints: [2] };
  for (const joint of [2, null]) expect(guessWords(secret, 'stiction', joint)).toBe('right');
  expect(guessWords(secret, 'stiction', 1)).toContain('effect is right');
  expect(guessWords(secret, 'backlash', 2)).toContain('joint is right');
});
