import { describe, expect, it } from 'vitest';
import { momentsBefore, WINDOWS } from './window';

describe('the axis of a chart that runs', () => {
  it('is written at whole seconds, from the window’s begin until now', () => {
    for (const seconds of WINDOWS) {
      const before = momentsBefore(1000.25, seconds).map((moment) => 1000.25 - moment);
      expect([before[0], before.at(-1)]).toEqual([seconds, 0]);
      expect(before.every((moment) => Number.isInteger(moment))).toBe(true);
    }
    expect(momentsBefore(0, 10)).toEqual([-10, -8, -6, -4, -2, 0]);
  });
});
