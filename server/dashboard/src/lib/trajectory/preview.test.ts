import { describe, expect, it } from 'vitest';
import type { Chain } from '../arm/chain';
import { curvesOf, movesInWords, postureAt, wayOf, type Motion } from './preview';

const JOINT = { name: '', revolute: true, alpha: 0, d: 0, theta: 0 };
const PLANAR: Chain = [
  { ...JOINT, alpha: Math.PI / 2, a: 0 },
  { ...JOINT, a: 1 },
];
const MOTION: Motion = {
  time: [0, 1, 2],
  set_points: [
    [0, 0],
    [0, Math.PI / 2],
    [0, -Math.PI / 2],
  ],
  moving: [2],
  duration: 2,
  violations: [],
};

describe('curves of a preview', () => {
  it('are those of the joints that move, in degrees, with their limits', () => {
    expect(curvesOf(MOTION, { joints: [{}, { low: 0, high: Math.PI }] })).toEqual([
      { joint: 2, values: [0, 90, -90], low: 0, high: 180 },
    ]);
    expect(curvesOf(MOTION, {})[0]).toMatchObject({ low: null, high: null });
  });

  it('are told with their speed and the room that they leave', () => {
    const limits = { joints: [{}, { low: -Math.PI, high: Math.PI }] };
    const kinds = [{ kind: 'revolute' }, { kind: 'revolute' }];
    expect(movesInWords(MOTION, kinds, limits)).toEqual([
      'joint 2: from 0.0°, between −90.0° and 90.0°, set points at most 180.0°/s, 90.0° to the end of its range',
    ]);
    const slides = [{ kind: 'revolute' }, { kind: 'prismatic' }];
    expect(movesInWords(MOTION, slides, {})[0]).toMatch(/and 1570\.8 mm, set points at most 3141\.6 mm\/s$/);
  });
});

describe('the way through space', () => {
  it('tells where the arm is outside of its range, its floor, its reach', () => {
    expect(wayOf(MOTION, PLANAR, { joints: [{}, { low: 0 }] }).outside).toEqual([false, false, true]);
    expect(wayOf(MOTION, PLANAR, { floor_height: -0.5 }).outside).toEqual([false, false, true]);
    expect(wayOf(MOTION, PLANAR, { reach: 0.5 }).outside).toEqual([true, true, true]);
    expect(wayOf(MOTION, PLANAR, {}).outside).toEqual([false, false, false]);
  });

  it('is thinned when it is long', () => {
    const time = Array.from({ length: 5000 }, (_, index) => index);
    const way = wayOf({ ...MOTION, time, set_points: time.map(() => [0, 0]) }, PLANAR, {});
    expect(way.points.length).toBe(1000);
    expect(way.times.at(-1)).toBe(4995);
  });
});

describe('the posture at a moment', () => {
  it('lies between the ones that are known, and at the ends outside of them', () => {
    expect(postureAt(MOTION, 0.5)).toEqual([0, Math.PI / 4]);
    expect(postureAt(MOTION, -1)).toEqual([0, 0]);
    expect(postureAt(MOTION, 9)).toEqual([0, -Math.PI / 2]);
  });
});
