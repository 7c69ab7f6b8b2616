/** The part of a record that is shown: zooming, moving, and what is to be asked for. Times in s. Pure. */

import type { Range } from './columns';

/** The shortest part that can be shown. */
export const SHORTEST = 0.1;
/** How much more than what is shown is asked for on either side, as a share: moving a little needs nothing new. */
const MARGIN = 0.3;

/** What is shown after zooming about a moment; `factor` < 1 comes nearer. null: all of it. */
export function zoomed(shown: Range | null, whole: Range, factor: number, about?: number): Range | null {
  const [low, high] = shown ?? whole;
  const middle = about ?? (low + high) / 2;
  const least = Math.min(SHORTEST, whole[1] - whole[0]);
  const span = Math.max(least, (high - low) * factor);
  const share = (middle - low) / (high - low || 1);
  return within([middle - share * span, middle + (1 - share) * span], whole);
}

/** What is shown after moving by a share of it. */
export function moved(shown: Range | null, whole: Range, share: number): Range | null {
  if (shown === null) return null;
  const way = share * (shown[1] - shown[0]);
  return within([shown[0] + way, shown[1] + way], whole);
}

/** A range pushed into the record; null when it is all of it. */
export function within(range: Range, whole: Range): Range | null {
  const span = Math.min(range[1] - range[0], whole[1] - whole[0]);
  const low = Math.min(Math.max(range[0], whole[0]), whole[1] - span);
  return span >= (whole[1] - whole[0]) * (1 - 1e-9) ? null : [low, low + span];
}

/** What to ask for to show a part in full detail. */
export function toAsk(shown: Range, whole: Range): Range {
  const more = MARGIN * (shown[1] - shown[0]);
  return [Math.max(whole[0], shown[0] - more), Math.min(whole[1], shown[1] + more)];
}

/** Whether what was asked for still serves: it covers what is shown, and not with much more than that. */
export function serves(asked: Range | null, shown: Range): boolean {
  if (asked === null) return false;
  const covers = asked[0] <= shown[0] && asked[1] >= shown[1];
  return covers && asked[1] - asked[0] <= 4 * (shown[1] - shown[0]);
}
