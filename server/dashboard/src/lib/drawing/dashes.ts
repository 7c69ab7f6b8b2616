/** Dashes of set points: where several lie on one another, each shows in the gaps of the others. Pure. */

const DASH = 6;
const GAP = 3;

/** Lengths of dashes and gaps (px) of the line at `place` (from 0) of `many` that may have the same values. */
export function dashesOf(place: number, many: number): number[] {
  const before = place * (DASH + GAP);
  const behind = (many - 1 - place) * (DASH + GAP) + GAP;
  // A dash of no length draws nothing: the gap behind it puts off the first one.
  return before > 0 ? [0, before, DASH, behind] : [DASH, behind];
}
