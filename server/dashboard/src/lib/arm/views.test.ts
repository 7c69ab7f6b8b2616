import { describe, expect, it } from 'vitest';
import type { Vector } from './chain';
import {
  cameraAt,
  fittingDistance,
  turned,
  turnOfKey,
  viewFrom,
  viewNamed,
  VIEWS,
  type ViewName,
} from './views';

const TARGET: Vector = [0.1, -0.2, 0.3];

describe('a view', () => {
  it('comes back from where its camera stands', () => {
    for (const name of Object.keys(VIEWS) as ViewName[]) {
      const view = viewNamed(name, 2);
      const found = viewFrom(cameraAt(view, TARGET), TARGET);
      expect(Math.cos(found.azimuth - view.azimuth), name).toBeCloseTo(1, 9);
      expect(found.elevation, name).toBeCloseTo(view.elevation, 9);
      expect(found.distance, name).toBeCloseTo(2, 9);
    }
  });

  it('never goes over the top, nor out of sight', () => {
    const above = turned(viewNamed('top', 1), 0, 3, 1, 1);
    expect(above.elevation).toBeLessThan(Math.PI / 2);
    expect(turned(above, 0, 0, 100, 1).distance).toBe(3);
    expect(turned(above, 0, 0, 0.001, 1).distance).toBe(0.35);
  });
});

describe('the distance that shows all', () => {
  it('has the sphere touch the edge of the narrower side', () => {
    const angle = Math.PI / 6;
    expect(fittingDistance(1, angle, 2) * Math.sin(angle / 2)).toBeCloseTo(1, 12);
    const narrow = fittingDistance(1, angle, 0.5);
    expect(Math.tan(Math.asin(1 / narrow))).toBeCloseTo(Math.tan(angle / 2) * 0.5, 12);
  });
});

describe('keys', () => {
  it('turn and zoom, there and back', () => {
    for (const [one, other] of [
      ['ArrowLeft', 'ArrowRight'],
      ['ArrowUp', 'ArrowDown'],
    ] as const) {
      const [back, forth] = [turnOfKey(one)!, turnOfKey(other)!];
      expect(back[0] + forth[0]).toBe(0);
      expect(back[1] + forth[1]).toBe(0);
    }
    expect(turnOfKey('+')![2] * turnOfKey('-')![2]).toBe(1);
    expect(turnOfKey('a')).toBeNull();
  });
});
