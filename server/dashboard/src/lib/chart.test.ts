import { describe, expect, it } from 'vitest';
import { apart, padded, withRoom } from './chart';

describe('the range of a chart', () => {
  it('leaves room, and does not draw noise as motion', () => {
    expect(padded(0, 10)).toEqual([-0.6000000000000005, 10.600000000000001]);
    const [low, high] = padded(0.001, 0.002, 1);
    expect(high - low).toBeCloseTo(1.12);
  });

  it('is something also without data', () => {
    expect(padded(Infinity, -Infinity)).toEqual([-1, 1]);
  });
});

describe('places at an axis', () => {
  it('are fewer where the chart is narrow, and always the last one', () => {
    const places = [-30, -25, -20, -15, -10, -5, 0];
    expect(withRoom(places, 800)).toEqual(places);
    expect(withRoom(places, 300)).toEqual([-30, -20, -10, 0]);
    expect(withRoom(places, 160).at(-1)).toBe(0);
  });
});

describe('names at the ends of lines', () => {
  it('stand where the lines end, when there is room', () => {
    expect(apart([10, 90, 50], 12, 0, 100)).toEqual([10, 90, 50]);
  });

  it('are moved apart, in the order of the lines', () => {
    const places = apart([50, 50, 30], 12, 0, 100);
    expect(places[2]).toBeLessThan(places[0] as number);
    const sorted = [...places].sort((one, other) => one - other);
    sorted
      .slice(1)
      .forEach((place, index) => expect(place - (sorted[index] as number)).toBeGreaterThanOrEqual(12));
  });

  it('do not change places for noise', () => {
    expect(apart([50, 51], 12, 0, 100)).toEqual([44.5, 56.5]);
    expect(apart([51, 50], 12, 0, 100)).toEqual([44.5, 56.5]);
  });

  it('stand about the middle of their lines, none further away than its stack is high', () => {
    const places = apart([50, 50, 50, 50, 50, 90], 12, 0, 100);
    expect(places).toEqual([26, 38, 50, 62, 74, 90]);
    expect(apart([50, 60, 70], 12, 0, 100)).toEqual([48, 60, 72]);
  });

  it('stay within the chart', () => {
    const places = apart([98, 99, 100], 12, 0, 100);
    expect(Math.max(...places)).toBeLessThanOrEqual(100);
  });
});
