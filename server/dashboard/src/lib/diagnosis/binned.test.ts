import { describe, expect, it } from 'vitest';
import { binnedPlot, rangeOf } from './binned';

describe('means in bins', () => {
  it('become points with whiskers, empty bins left out', () => {
    const plot = binnedPlot([-1, 0, 1], [-2, null, 2], [0.5, null, null], [-4, 4]);
    expect(plot?.points).toEqual([
      { x: 0, y: 0.75, low: 0.8125, high: 0.6875 },
      { x: 1, y: 0.25, low: 0.25, high: 0.25 },
    ]);
    expect(plot?.zero).toBe(0.5);
  });

  it('are no plot with a single one left', () => {
    expect(binnedPlot([0, 1], [null, 1], [null, 1])).toBeNull();
  });

  it('have zero in their range', () => {
    const [low, high] = rangeOf([{ values: [3, 4], deviations: [1, null] }]);
    expect(low).toBeLessThan(0);
    expect(high).toBeGreaterThan(4);
    expect(rangeOf([])[1]).toBeGreaterThan(0);
  });
});
