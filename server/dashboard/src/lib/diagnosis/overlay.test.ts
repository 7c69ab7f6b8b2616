import { describe, expect, it } from 'vitest';
import type { Overlay } from '../api/types';
import { positionColumns, residualColumns, shownUnit } from './overlay';

const overlay: Overlay = {
  trace: 'a',
  held_out: false,
  joints: [1, 2],
  units: ['rad', 'm'],
  samples: 2,
  time: [0, 0.02],
  measured: [
    [0, Math.PI],
    [0.1, 0.2],
  ],
  set_point: null,
  simulated: [
    [
      [0, null],
      [0.1, 0.1],
    ],
  ],
  residual: [
    [
      [0, null],
      [0, 0.1],
    ],
  ],
};

describe('overlays', () => {
  it('are shown in degrees and millimetres, with gaps where there is no number', () => {
    expect(positionColumns(overlay, 0)).toEqual([
      [0, 0.02],
      [0, 180],
      [0, null],
    ]);
    expect(residualColumns(overlay, 1)).toEqual([
      [0, 0.02],
      [0, 100],
    ]);
    expect(shownUnit('N·m')).toEqual([1, 'N·m']);
  });

  it('have the set point first where there is one', () => {
    const columns = positionColumns(
      {
        ...overlay,
        set_point: [
          [1, 1],
          [0, 0],
        ],
      },
      1,
    );
    expect(columns.map((column) => column.at(-1))).toEqual([0.02, 0, 200, 100]);
  });
});
