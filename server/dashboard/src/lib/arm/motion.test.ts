import { describe, expect, it } from 'vitest';
import type { Chain } from './chain';
import { farthest, metresOfPixel, outlineOf } from './motion';

const joint = (a: number): Chain[number] => ({
  name: 'joint',
  revolute: true,
  a,
  alpha: 0,
  d: 0,
  theta: 0,
});
const CHAIN: Chain = [joint(0.4), joint(0.3), joint(0)];

describe('how far an arm has moved', () => {
  it('is nothing when nothing has', () => {
    const outline = outlineOf(CHAIN, [0.1, 0.2, 0.3], 0.1);
    expect(farthest(outline, outlineOf(CHAIN, [0.1, 0.2, 0.3], 0.1))).toBe(0);
    expect(farthest(null, null)).toBe(0);
  });

  it('is the way of what moves most', () => {
    const before = outlineOf(CHAIN, [0, 0, 0], 0.1);
    expect(farthest(before, outlineOf(CHAIN, [0.01, 0, 0], 0.1))).toBeCloseTo(0.008, 4);
    expect(farthest(before, outlineOf(CHAIN, [0, 0, 0.5], 0.1))).toBeCloseTo(0.0495, 3);
  });

  it('is without end when an arm comes or goes', () => {
    expect(farthest(null, outlineOf(CHAIN, [0, 0, 0], 0.1))).toBe(Infinity);
  });
});

describe('what a pixel shows', () => {
  it('follows from distance and field of view', () => {
    expect(metresOfPixel(2, Math.PI / 2, 400)).toBeCloseTo(0.01);
  });
});
