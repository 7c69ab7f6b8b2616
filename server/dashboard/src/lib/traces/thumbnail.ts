/** A trace at a glance: the lines of a picture the size of a thumb. Pure. */

import type { Signals } from './columns';

export interface Thumbnail {
  /** Of the joints that moved, less where they began, on one scale; `x,y` in a box of 100 by 24. */
  positions: { joint: number; points: string }[];
  /** The largest error of any joint, from the foot of a box of 100 by 10. */
  error: string;
}

export function thumbnailOf(signals: Signals, moved: readonly number[]): Thumbnail {
  const { time, joints, position } = signals;
  const [first, last] = [time[0] ?? 0, time.at(-1) ?? 1];
  const x = (index: number): string => ((100 * (time[index]! - first)) / (last - first || 1)).toFixed(1);
  const shifted = position.map((row) => row.map((value) => value - (row[0] ?? 0)));
  const places = joints.map((_, place) => place).filter((place) => moved.includes(joints[place]!));
  const shown = places.map((place) => shifted[place]!);
  const low = Math.min(0, ...shown.flat());
  const high = Math.max(0, ...shown.flat());
  const y = (value: number): string => (22 - (20 * (value - low)) / (high - low || 1)).toFixed(1);
  const errors = time.map((_, index) =>
    Math.max(0, ...places.map((place) => Math.abs(signals.error?.[place]?.[index] ?? 0))),
  );
  const most = Math.max(...errors) || 1;
  return {
    positions: places.map((place, number) => ({
      joint: joints[place]!,
      points: shown[number]!.map((value, index) => `${x(index)},${y(value)}`).join(' '),
    })),
    error: `0,10 ${errors.map((value, index) => `${x(index)},${(10 - (9 * value) / most).toFixed(1)}`).join(' ')} 100,10`,
  };
}
