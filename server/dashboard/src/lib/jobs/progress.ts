/** How far something is that still runs: never all of it, since what is done runs no more. Pure. */

/** Whole percent, at most 99. */
export function percentDone(fraction: number | null | undefined): number {
  return Math.min(99, Math.max(0, Math.floor(100 * (fraction ?? 0))));
}

/** An experiment that runs, as it is shown: after its motion its trace has still to be written. */
export function progressOf(told: { fraction: number; text: string }): {
  fraction: number;
  percent: number;
  text: string;
} {
  const percent = percentDone(told.fraction);
  const text = told.fraction >= 1 ? 'saving the trace' : told.text;
  return { fraction: percent / 100, percent, text };
}
