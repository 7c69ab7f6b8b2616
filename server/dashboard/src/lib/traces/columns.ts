/** Signals of traces as columns to be drawn: finer where it has been zoomed to, several traces over one time. Pure. */

/** As the service tells them: one row a joint, in the order of `joints`; a signal that the trace has not is null. */
export interface Signals {
  readonly joints: readonly number[];
  /** Before thinning. */
  readonly samples: number;
  readonly time: readonly number[];
  readonly position: readonly (readonly number[])[];
  readonly set_point: readonly (readonly number[])[] | null;
  readonly error: readonly (readonly number[])[] | null;
  readonly drive: readonly (readonly number[])[] | null;
}

export const NAMES = ['position', 'set_point', 'error', 'drive'] as const;
export type SignalName = (typeof NAMES)[number];
export type Range = readonly [number, number];

/** rad, or m: a set point that is farther from where it began belongs to a motion. */
const MOVES = 0.005;

/** When a trace's motion begins, s: by its set points, or by positions where it has none; its first moment without. */
export function motionBegin({ time, set_point, position }: Signals): number {
  const rows = set_point ?? position;
  const index = time.findIndex((_, at) => rows.some((row) => Math.abs(row[at]! - row[0]!) > MOVES));
  return time[Math.max(0, index)] ?? 0;
}

/** The same signals with `zero` (s) as their time 0. */
export function counted(signals: Signals, zero: number): Signals {
  return zero === 0 ? signals : { ...signals, time: signals.time.map((at) => at - zero) };
}

/** Whether the trace has more samples than are here. */
export function isThinned(signals: Signals): boolean {
  return signals.time.length < signals.samples;
}

/** The whole, with a finer part in its place. */
export function refined(whole: Signals, part: Signals): Signals {
  const [begin, end] = [part.time[0], part.time.at(-1)];
  if (begin === undefined || end === undefined) return whole;
  const before = whole.time.findIndex((time) => time >= begin);
  const from = before === -1 ? whole.time.length : before;
  const after = whole.time.findIndex((time) => time > end);
  const to = after === -1 ? whole.time.length : after;
  const spliced = (old: readonly number[], fine: readonly number[]): number[] => [
    ...old.slice(0, from),
    ...fine,
    ...old.slice(to),
  ];
  const rows = (name: SignalName): readonly (readonly number[])[] | null => {
    const [old, fine] = [whole[name], part[name]];
    return old && fine ? old.map((row, index) => spliced(row, fine[index] ?? [])) : old;
  };
  return {
    ...whole,
    time: spliced(whole.time, part.time),
    position: rows('position') ?? [],
    set_point: rows('set_point'),
    error: rows('error'),
    drive: rows('drive'),
  };
}

/** The column of one signal of one joint (from 1), less `begin`, times `scale`; null where the trace has none. */
export function columnOf(
  signals: Signals,
  name: SignalName,
  joint: number,
  scale = 1,
  begin = 0,
): number[] | null {
  const row = signals[name]?.[signals.joints.indexOf(joint)];
  return row === undefined ? null : row.map((value) => (value - begin) * scale);
}

/** Where a joint is told to be at first, or is. */
export function startOf(signals: Signals, joint: number): number {
  const place = signals.joints.indexOf(joint);
  return signals.set_point?.[place]?.[0] ?? signals.position[place]?.[0] ?? 0;
}

/** From the first to the last moment of all of them; null where there is none. */
export function wholeRange(all: readonly Signals[]): Range | null {
  const begins = all.flatMap((one) => one.time.slice(0, 1));
  const ends = all.flatMap((one) => one.time.slice(-1));
  return begins.length === 0 ? null : [Math.min(...begins), Math.max(...ends)];
}

/** Root mean square of what a column has. */
export function rmsOf(column: readonly (number | null)[]): number {
  const there = column.filter((value) => value !== null);
  return Math.sqrt(there.reduce((sum, value) => sum + value ** 2, 0) / there.length);
}

/** Root mean square of the difference of two columns of the same moments. */
export function rmsDifference(one: readonly number[], other: readonly number[]): number {
  const sum = one.reduce((total, value, index) => total + (value - other[index]!) ** 2, 0);
  return Math.sqrt(sum / one.length);
}
