import { describe, expect, it } from 'vitest';
import { partsOf } from './columns';
import { STANDARD, type Place } from './layout';

const place = (x: number, y: number, w: number, h: number): Place => ({ x, y, w, h });

describe('parts of a layout', () => {
  it('are columns that share no rows: the arm with its keys stretches no chart', () => {
    const kinds = partsOf(STANDARD.panels).map((band) =>
      band.map((part) => part.panels.map((one) => one.kind).sort()),
    );
    expect(kinds).toEqual([
      [
        ['charts', 'hand'],
        ['arm', 'link', 'table'],
      ],
    ]);
  });

  it('are bands where a panel goes over the whole width, with the free rows above', () => {
    const [wide, left, right] = [place(0, 1, 12, 4), place(0, 5, 6, 9), place(7, 6, 5, 3)];
    expect(partsOf([right, left, wide])).toEqual([
      [{ ...place(0, 0, 12, 5), panels: [wide] }],
      [
        { ...place(0, 5, 6, 9), panels: [left] },
        { ...place(7, 5, 5, 9), panels: [right] },
      ],
    ]);
  });

  it('are one where panels are interlocked', () => {
    const panels = [place(0, 0, 6, 4), place(6, 0, 6, 8), place(0, 4, 6, 8), place(3, 2, 6, 1)];
    expect(partsOf(panels).flat()).toHaveLength(1);
    expect(partsOf([])).toEqual([]);
  });
});
