import { describe, expect, it } from 'vitest';
import type { DiagnosisStep, TriedEffect } from '../api/types';
import { heatOverTime, scenesOf, shrunkOf, toldOf } from './story';

const tried = (effect: string, evidence: number, misfit: number, refitted = true): TriedEffect =>
  ({
    effect,
    joints: [2],
    called: `${effect} on joint 2`,
    evidence,
    misfit,
    refitted,
    evidence_held_out: null,
  }) as unknown as TriedEffect;

describe('candidates', () => {
  const step = {
    candidates: [tried('b', 96, 1.4), tried('a', 100, 1.0), tried('c', 300, 1, false)],
    group: [],
    effect: 'a',
    joints: [2],
  } as unknown as DiagnosisStep;

  it('share the posterior of those that were fitted, and each has one sentence for and against it', () => {
    const [best, next] = toldOf(step, 10);
    expect(best!.share).toBeCloseTo(1 / (1 + Math.exp(-2)));
    expect([best!.named, next!.named]).toEqual([true, false]);
    expect(best!.speaksAgainst).toBe('Nothing found: the next best has 4 less.');
    expect(next!.speaksFor).toBe('Evidence 96; 10 is enough for a name.');
    expect(next!.speaksAgainst).toBe('Evidence 4 below the best, and leaves 1.40 times the noise.');
  });
});

const RAD = Math.PI / 180;

it('the error shrinks on held-out traces where there are any, in degrees', () => {
  const gap = {
    joints: [2],
    units: ['rad'],
    noise: [0.03 * RAD],
    stages: [
      { fitted: [0.3 * RAD], held_out: [0.2 * RAD] },
      { fitted: [0.04 * RAD], held_out: [0.03 * RAD] },
    ],
  };
  const { joints, isHeldOut } = shrunkOf({ gap } as never);
  expect(isHeldOut).toBe(true);
  expect([joints[0]!.was, joints[0]!.left]).toEqual([1, expect.closeTo(0.15)]);
  expect([joints[0]!.before, joints[0]!.after, joints[0]!.unit]).toEqual(['0.20', '0.030', '°']);
  expect(shrunkOf({ gap: null }).joints).toEqual([]);
});

it('a joint is hot while its motion is not explained', () => {
  const time = Array.from({ length: 101 }, (_, index) => index * 0.1);
  const row = time.map((at) => (at < 5 ? 0 : 0.1));
  const signals = [{ trace: 'a', joints: [2], time, measured: [row], residual: [[row]], held_out: false }];
  const gap = { joints: [2], noise: [0.01], stages: [], units: [] };
  const [scene] = scenesOf({ signals, efforts: [], gap, rmse_fit: [] } as never);
  const [heat] = heatOverTime(scene!, 4, 0);
  expect([heat![0], heat![3]]).toEqual([0, 1]);
});
