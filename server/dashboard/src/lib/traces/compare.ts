/** Two traces beside each other: shifted until they lie best, and their difference. Pure; times in s. */

import { columnOf, motionBegin, type Signals } from './columns';

/** s on either side of the begins of both motions within which the best shift is looked for. */
const REACH = 2;
/** Tried in every round; each round looks closer by this factor. */
const TRIED = 40;
const ROUNDS = 3;
/** Moments at which two traces are compared: enough for a shift that a person can see. */
const MOMENTS = 400;

/** Of what can be drawn beside an overlay, what there is for so many traces: a difference needs two. */
export function besideOf<Name extends string>(names: readonly Name[], traces: number): Name[] {
  return names.filter((name) => name !== 'difference' || traces > 1);
}

/** The value of a column at a moment, between its samples; null before the first and after the last. */
export function valueAt(time: readonly number[], column: readonly number[], moment: number): number | null {
  const last = time.length - 1;
  if (last < 0 || moment < time[0]! || moment > time[last]!) return null;
  let [low, high] = [0, last];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (time[middle]! <= moment) low = middle;
    else high = middle;
  }
  const [before, after] = [time[low]!, time[high]!];
  const share = after === before ? 0 : (moment - before) / (after - before);
  return column[low]! + share * (column[high]! - column[low]!);
}

/** `other` less `reference` at the moments of the reference; null where there is no other. */
export function difference(
  reference: { time: readonly number[]; column: readonly number[] },
  other: { time: readonly number[]; column: readonly number[] },
): (number | null)[] {
  return reference.time.map((moment, index) => {
    const value = valueAt(other.time, other.column, moment);
    return value === null ? null : value - reference.column[index]!;
  });
}

/**
 * s by which the motion of `other` comes later than that of `reference`, beyond the difference of their begins: where
 * the mean square of the difference of their positions (each less its first) is smallest. 0 if they cannot be compared.
 */
export function bestShift(reference: Signals, other: Signals, joint: number): number {
  const [one, two] = [moving(reference, joint), moving(other, joint)];
  if (one === null || two === null) return 0;
  const [begin, end] = [one.time[0]!, one.time.at(-1)!];
  const moments = Array.from({ length: MOMENTS }, (_, at) => begin + ((end - begin) * at) / (MOMENTS - 1));
  const wanted = moments.map((moment) => valueAt(one.time, one.column, moment)!);
  const cost = (shift: number): number => {
    let [sum, count] = [0, 0];
    moments.forEach((moment, at) => {
      const value = valueAt(two.time, two.column, moment + shift);
      if (value === null) return;
      sum += (value - wanted[at]!) ** 2;
      count += 1;
    });
    return count < MOMENTS / 2 ? Infinity : sum / count;
  };
  let [best, reach] = [0, REACH];
  for (let round = 0; round < ROUNDS; round += 1) {
    const around = best;
    for (let at = -TRIED; at <= TRIED; at += 1) {
      const shift = around + (at * reach) / TRIED;
      if (cost(shift) < cost(best)) best = shift;
    }
    reach /= TRIED / 2;
  }
  return best;
}

/** A joint's position less its first, over the time since its trace's motion began. */
function moving(signals: Signals, joint: number): { time: number[]; column: number[] } | null {
  const column = columnOf(signals, 'position', joint, 1, columnOf(signals, 'position', joint)?.[0] ?? 0);
  const begin = motionBegin(signals);
  return column && column.length > 1 ? { time: signals.time.map((at) => at - begin), column } : null;
}
