import { describe, expect, it } from 'vitest';
import type { PhaseCell } from '../api/types';
import { disagreementMap, levelName, levelOf, LEVELS, phaseSummaries, timeTicks } from './heatmap';

const cell = (joint: number, start: number, phase: PhaseCell['phase'], square: number): PhaseCell => ({
  joint,
  start,
  end: start + 0.3,
  phase,
  mean_square: square,
  significance: square > 4 ? 9 : 0,
  trace: 0,
});
const cells = [
  cell(1, 0.0, 'ramp_start', 1),
  cell(1, 0.3, 'steady_ramp', 1),
  cell(1, 0.6, 'steady_ramp', 1),
  cell(1, 0.9, 'hold', 1),
  cell(2, 0.0, 'ramp_start', 100),
  cell(2, 0.3, 'steady_ramp', 16),
  cell(2, 0.6, 'steady_ramp', 0),
  cell(2, 0.9, 'hold', 1),
];

describe('the map of disagreement', () => {
  it('has a row for every joint and phase that occurs, and a column for each window where there is room', () => {
    const map = disagreementMap(cells, 0, 40, 3);
    expect(map.rows.map((row) => [row.joint, row.phase])).toEqual([
      [1, 'ramp_start'],
      [1, 'steady_ramp'],
      [1, 'hold'],
      [2, 'ramp_start'],
      [2, 'steady_ramp'],
      [2, 'hold'],
    ]);
    expect(map.edges).toHaveLength(5);
    expect(map.rows[3]?.cells.map((one) => one?.times ?? null)).toEqual([10, null, null, null]);
  });

  it('puts windows together by their mean square where there is no room', () => {
    const map = disagreementMap(cells, 0, 2, 3);
    const steady = map.rows[4]?.cells ?? [];
    expect(steady.map((one) => one?.windows ?? 0)).toEqual([1, 1]);
    const one = disagreementMap(cells, 0, 1, 3).rows[4]?.cells[0];
    expect(one?.times).toBeCloseTo(Math.sqrt(8));
    expect(one).toMatchObject({ windows: 2, beyond: 1, significance: 9, level: 2 });
  });

  it('loses no window, however many columns there are', () => {
    for (const columns of [1, 2, 3, 4, 7]) {
      const map = disagreementMap(cells, 0, columns, 3);
      const counted = map.rows.flatMap((row) => row.cells).reduce((sum, one) => sum + (one?.windows ?? 0), 0);
      expect(counted).toBe(cells.length);
    }
  });

  it('has round moments below it, wherever its columns end', () => {
    expect(timeTicks([0, 0.35, 3.16], 8)).toEqual([0, 0.5, 1, 1.5, 2, 2.5, 3]);
    expect(timeTicks([0.7, 55.2], 8)).toEqual([10, 20, 30, 40, 50]);
    expect(timeTicks([0, 0.3], 8)).toEqual([0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3]);
    expect(timeTicks([], 8)).toEqual([]);
  });

  it('is empty for a trace that it has nothing about', () => {
    expect(disagreementMap(cells, 1, 10, 3).rows).toEqual([]);
    expect(disagreementMap([], 0, 10, 3).edges).toEqual([]);
  });

  it('names the worst window of a joint and phase', () => {
    const table = phaseSummaries(cells, 0, 3);
    const found = table.find((one) => one.joint === 2 && one.phase === 'steady_ramp');
    expect(found).toMatchObject({ worst: 4, worstAt: 0.3, windows: 2, beyond: 1 });
    expect(table).toHaveLength(6);
  });

  it('has levels without a gap', () => {
    expect([0, 1.25, 1.26, 2, 3, 8, 9, 1e9].map(levelOf)).toEqual([0, 0, 1, 1, 2, 3, 4, 4]);
    expect(LEVELS.map((_, level) => levelName(level))).toEqual([
      'noise, to 1.25×',
      'to 2×',
      'to 4×',
      'to 8×',
      'over 8×',
    ]);
  });
});
