import { describe, expect, it } from 'vitest';
import type { DiagnosisStep, Overlay, TriedEffect } from '../api/types';
import {
  answeredJoints,
  besideAnswer,
  closedWords,
  closesGap,
  heatOverTime,
  scenesOf,
  shareText,
  shrunkOf,
  toldOf,
  worstMoment,
  type Scene,
} from './story';

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
    expect(best!.speaksAgainst).toBe('Nothing; the next best has 4 less.');
    expect(best!.speaksFor).toBe('Evidence 100; 10 is enough for a name.');
    expect(next!.speaksFor).toBe('Evidence 96.');
    expect([best!.share, 0.9996, 0.0004, 0.05].map(shareText)).toEqual([
      '88 %',
      '> 99.9 %',
      '< 0.1 %',
      '5.0 %',
    ]);
    expect(next!.speaksAgainst).toBe('Evidence 4 below the best, and leaves 1.40 times the noise.');
  });
});

const RAD = Math.PI / 180;

it('with the answer the joints that are still red at times are named', () => {
  const scene = (left: number) => ({
    drift: {
      joints: [1, 2],
      step: 1,
      duration: 9,
      posture: [],
      gap: [],
      square: [[], [0, left].map((one) => Array(10).fill(one ** 2))],
    },
    noise: [1, 1],
  });
  expect(closedWords(scene(0.9))).toContain('no joint is red any more');
  expect(closedWords(scene(4))).toContain('joint 2 is still red at times');
});

it('an answer closes the gap where it adopted something, and not because there are two simulations', () => {
  const found = (adopted: boolean) => ({
    steps: [{ adopted }] as DiagnosisStep[],
    signals: [{ residual: [[], []] }] as unknown as Overlay[],
  });
  expect([found(true), found(false), null].map(closesGap)).toEqual([true, false, false]);
});

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

describe('where, once there is an answer for joint 3', () => {
  const time = Array.from({ length: 201 }, (_, index) => index * 0.05);
  const pulse = (from: number, size: number): number[] =>
    time.map((at) => (at >= from && at < from + 2 ? size : 0));
  const none = time.map(() => 0);
  /** Joint 2 is off most, early; joint 3 later. */
  const before = [pulse(2, 0.2), pulse(2, 0.04).map((one, index) => one + pulse(6, 0.1)[index]!)];
  const sceneWith = (...residual: number[][][]) => {
    const signals = [{ trace: 'a', joints: [2, 3], time, measured: [none, none], residual, held_out: false }];
    const gap = { joints: [2, 3], noise: [0.01, 0.01], stages: [], units: [] };
    return scenesOf({ signals, efforts: [], gap, rmse_fit: [] } as never)[0]!;
  };
  const steps = [
    { adopted: true, joints: [3] },
    { adopted: false, joints: [1] },
  ];
  const answered = answeredJoints({ steps } as never);

  it('opens where its joint is worst, not where another joint glows', () => {
    const scene = sceneWith(before, [none, none]);
    expect(answered).toEqual([3]);
    expect(worstMoment(scene, answered, 100)).toBeGreaterThan(6);
    expect(worstMoment(scene, [], 100)).toBeLessThan(5);
  });

  it('says of another joint that is red whether the answer explains it', () => {
    const said = (scene: Scene, ...more: [number[], number[]?, number[]?]): string =>
      besideAnswer(
        scene,
        more[0],
        [0, 1].map((closed) => heatOverTime(scene, 120, closed)),
        more[1],
        more[2],
      );
    const explained = sceneWith(before, [none, none]);
    expect(said(explained, answered)).toContain('Joint 2: no longer red with the answer');
    const left = sceneWith(before, [before[0]!, none]);
    const partly = 'Joint 2: the answer explains it only in part, and nothing else was named.';
    expect(said(left, answered)).toBe(partly);
    expect(said(left, answered, undefined, [2])).toBe(`${partly} “Unexplained torque” shows what is left.`);
    expect(said(sceneWith(before), answered)).toContain('Joint 2 may be red');
    expect(said(sceneWith([none, before[1]!], [none, none]), answered)).toBe('');
    expect(said(explained, [])).toBe('');
    expect(said(explained, [], [3])).toBe('Joint 2: not explained, and not examined.');
    expect(said(left, answered, [3])).toBe('Joint 2: not explained, and not examined.');
  });
});
