/** Dashes of set points: where several lie on one another, each shows in the gaps of the others. Pure. */

const DASH = 6;
const GAP = 4;

/** Lengths of dashes and gaps (px) of the line at `place` (from 0) of `many` that may have the same values. */
export function dashesOf(place: number, many: number): number[] {
  if (many < 2) return [DASH, GAP];
  // A dash of no length draws nothing: the gap behind it puts off the first one.
  return [0, place * DASH, DASH, (many - 1 - place) * DASH];
}
