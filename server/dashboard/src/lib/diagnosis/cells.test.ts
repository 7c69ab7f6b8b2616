import { describe, expect, it } from 'vitest';
import type { PhaseCell } from '../api/types';
import { cellMeaning } from './cells';

describe('a cell of the map', () => {
  const cell = (mean_square: number, significance: number, trace = 0): PhaseCell => ({
    joint: 1,
    start: 0,
    end: 0.3,
    phase: 'hold',
    mean_square,
    significance,
    trace,
  });

  it('is a window, which chance takes further than a whole phase', () => {
    const said = cellMeaning([cell(1, 0), cell(3.61, 2.5), cell(25, 9), cell(100, 9, 1)], 0, 3);
    expect(said).toContain('one window of 0.3 s');
    expect(said).toContain('up to 1.9 times');
    expect(said).toContain('Beyond chance: 1 of 3 windows.');
  });

  it('says nothing of chance where every window is beyond it, and nothing without windows', () => {
    expect(cellMeaning([cell(25, 9)], 0, 3)).not.toContain('times');
    expect(cellMeaning([cell(25, 9)], 1, 3)).toBe('');
  });
});
