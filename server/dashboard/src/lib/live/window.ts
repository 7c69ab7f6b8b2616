/** The part of a recording that a chart shows, thinned to what its width can show. Pure. */

import type { Column, Recording, Signal } from './recording';

/** s that a chart can show. */
export const WINDOWS = [10, 30, 60, 300] as const;

/** Moments at which the time is written, whole seconds before `now`: a window of 30 s every 5 s, one of 10 s every 2 s. */
export function momentsBefore(now: number, seconds: number): number[] {
  const parts = seconds % 6 === 0 ? 6 : 5;
  return Array.from({ length: parts + 1 }, (_, index) => now - seconds + (index * seconds) / parts);
}

/** Rows above which columns are thinned. Half a minute is drawn as it came: drawing leaves out what shows nothing. */
export const MOST_ROWS = 2000;

export interface Shown {
  time: number[];
  /** One a joint asked for. */
  columns: Column[];
}

/** A signal of a joint (its place in the recording), and what its values are multiplied with. */
export type Asked = readonly [signal: Signal, place: number, factor: number];

/** These signals in [from, to], plus one row on either side. */
export function shownPart(recording: Recording, asked: readonly Asked[], from: number, to: number): Shown {
  const first = Math.max(0, recording.rowAt(from) - 1);
  const last = Math.min(recording.time.length, recording.rowAt(to) + 1);
  const columns = asked.map(([signal, place]) => recording.columns[signal][place] ?? []);
  const factors = asked.map(([, , factor]) => factor);
  const every = Math.ceil((last - first) / MOST_ROWS);
  if (every <= 1) {
    const part = columns.map((column) => column.slice(first, last));
    return {
      time: recording.time.slice(first, last),
      columns: part.map((column, index) => scaled(column, factors[index] ?? 1)),
    };
  }
  const part = thinned(recording, columns, first, last, 2 * every);
  return {
    time: part.time,
    columns: part.columns.map((column, index) => scaled(column, factors[index] ?? 1)),
  };
}

/**
 * Of every stretch of time the smallest and the largest value, in the order in which they came: no peak is lost.
 * Stretches lie at whole multiples of their length, so that a curve that moves does not shimmer.
 */
function thinned(
  recording: Recording,
  columns: readonly Column[],
  first: number,
  last: number,
  rows: number,
): Shown {
  const length = rows * recording.period;
  const time: number[] = [];
  const made: Column[] = columns.map(() => []);
  let begin = first;
  while (begin < last) {
    const stretch = Math.floor((recording.time[begin] as number) / length);
    let end = begin + 1;
    while (end < last && Math.floor((recording.time[end] as number) / length) === stretch) end += 1;
    time.push(stretch * length, (stretch + 0.5) * length);
    columns.forEach((column, index) => made[index]?.push(...extremes(column, begin, end)));
    begin = end;
  }
  return { time, columns: made };
}

function extremes(column: Column, begin: number, end: number): [number | null, number | null] {
  let low: number | null = null;
  let high: number | null = null;
  let lowFirst = true;
  for (let row = begin; row < end; row += 1) {
    const value = column[row] ?? null;
    if (value === null) continue;
    if (low === null || value < low) {
      low = value;
      lowFirst = false;
    }
    if (high === null || value > high) {
      high = value;
      lowFirst = true;
    }
  }
  return lowFirst ? [low, high] : [high, low];
}

/** In place: the column is a copy. */
function scaled(column: Column, factor: number): Column {
  if (factor === 1) return column;
  for (let row = 0; row < column.length; row += 1) {
    const value = column[row] ?? null;
    if (value !== null) column[row] = value * factor;
  }
  return column;
}
