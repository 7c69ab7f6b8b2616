/** Dashes of set points: where several lie on one another, each shows in the gaps of the others. Pure. */

import type { Pen } from './line';

const DASH = 6;
/** Of a line alone; else the others' dashes are the gap. */
const GAP = 3;

/** Lengths of dashes and gaps (px) of the line at `place` (from 0) of `many` that may have the same values. */
export function dashesOf(place: number, many: number): number[] {
  const before = place * DASH;
  const behind = Math.max(GAP, (many - 1) * DASH) - before;
  // A dash of no length draws nothing: the gap behind it puts off the first one.
  return before > 0 ? [0, before, DASH, behind] : [DASH, behind];
}

/**
 * Draws the dashes of a line that goes to the right. Their lengths are counted along the screen: along the line itself
 * those of a curve that swings within a few px would be used up in its height.
 */
export class DashedPen implements Pen {
  private x = NaN;
  private y = NaN;
  private isDown = false;
  private readonly drawn: (readonly [from: number, to: number])[] = [];
  private readonly period: number;

  /** `dashes`: lengths of dashes and gaps. */
  constructor(
    private readonly pen: Pen,
    dashes: readonly number[],
  ) {
    let end = 0;
    dashes.forEach((length, index) => {
      if (index % 2 === 0 && length > 0) this.drawn.push([end, end + length]);
      end += length;
    });
    this.period = end;
  }

  moveTo(x: number, y: number): void {
    [this.x, this.y, this.isDown] = [x, y, false];
  }

  lineTo(x: number, y: number): void {
    const [x0, y0, way] = [this.x, this.y, x - this.x];
    const at = (place: number): number => (way > 0 ? y0 + ((y - y0) * (place - x0)) / way : y0);
    for (let begin = Math.floor(x0 / this.period) * this.period; begin <= x; begin += this.period)
      for (const [from, to] of this.drawn) {
        const [left, right] = [Math.max(x0, begin + from), Math.min(x, begin + to)];
        if (left > right || begin + to <= x0) continue;
        if (!this.isDown || left > x0) this.pen.moveTo(left, at(left));
        this.pen.lineTo(right, right === x ? y : at(right));
        this.isDown = right === x;
      }
    [this.x, this.y] = [x, y];
  }
}
