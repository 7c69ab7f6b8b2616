/**
 * What a response between two cursors tells: rise time, overshoot, settling time, as they are defined in control
 * engineering and as the service computes them for a whole trace: of the way of the set point, from where the position
 * rests before it.
 */

/** Rise time is counted between these shares of the way. */
export const RISE_FROM = 0.1;
export const RISE_TO = 0.9;
/** Settled within this share of the way around the target. */
export const SETTLING_BAND = 0.02;
/** Where there is no set point, the target is the mean over this last share of the window. */
const TAIL = 0.1;

export interface Response {
  /** s, increasing. */
  readonly time: ArrayLike<number>;
  readonly position: ArrayLike<number>;
  /** Same length; null where the trace has none. */
  readonly setPoint: ArrayLike<number> | null;
}

/** Sets of the set point further apart than this, s, are motions of their own. */
export const ONE_GO = 0.5;

/** A quantity that the window does not tell is null. Times in s, values in the unit of the position. */
export interface StepMeasures {
  readonly begin: number;
  readonly end: number;
  /** Where the position rests before the motion begins. */
  readonly initial: number;
  /** The last set point of the window, or where the position ends when there is none. */
  readonly target: number;
  readonly targetIsSetPoint: boolean;
  /** Whether the set point goes one way in one go. Only then are rise time, overshoot and settling time told. */
  readonly isStep: boolean;
  /** From 10 % to 90 % of the way. */
  readonly riseTime: number | null;
  /** Beyond the target, in the direction of the motion. */
  readonly overshoot: number | null;
  readonly overshootShare: number | null;
  /** From the beginning of the motion (first change of the set point, or the window's begin) until it stays within the band. */
  readonly settlingTime: number | null;
  /** Target − position at the window's end. */
  readonly finalError: number;
}

/** Measures between two moments (s), in either order; null where fewer than three samples lie between. */
export function measureStep(response: Response, from: number, to: number): StepMeasures | null {
  const first = indexAt(response.time, Math.min(from, to));
  const end = indexAfter(response.time, Math.max(from, to));
  if (end - first < 3) return null;
  const { time, position, setPoint } = response;
  const initial = meanOf(position, first, Math.max(first + 1, motionBegin(setPoint, first, end)));
  const target = setPoint
    ? setPoint[end - 1]!
    : meanOf(position, end - Math.max(1, Math.round((end - first) * TAIL)), end);
  const way = target - (setPoint ? setPoint[first]! : initial);
  const isStep = setPoint === null || goesOneWay(time, setPoint, first, end);
  const moves = isStep && Math.abs(way) > spreadOf(position, first, end) * 1e-3;
  const overshoot = moves ? overshootOf(position, first, end, target, Math.sign(way)) : null;
  return {
    begin: time[first]!,
    end: time[end - 1]!,
    initial,
    target,
    targetIsSetPoint: setPoint !== null,
    isStep,
    riseTime: moves ? riseTimeOf(response, first, end, initial, way) : null,
    overshoot,
    overshootShare: overshoot === null ? null : overshoot / Math.abs(way),
    settlingTime: moves ? settlingTimeOf(response, first, end, target, Math.abs(way)) : null,
    finalError: target - position[end - 1]!,
  };
}

/**
 * Whether a set point goes one way in one go, as a step and a ramp do: never back, and never resting in between. A
 * multisine or a staircase has no rise time.
 */
export function goesOneWay(
  time: ArrayLike<number>,
  setPoint: ArrayLike<number>,
  first = 0,
  end = setPoint.length,
): boolean {
  let direction = 0;
  let last: number | null = null;
  for (let index = first + 1; index < end; index++) {
    const change = setPoint[index]! - setPoint[index - 1]!;
    if (change === 0) continue;
    if (direction === 0) direction = Math.sign(change);
    const isRested = last !== null && time[index]! - last > ONE_GO;
    if (Math.sign(change) !== direction || isRested) return false;
    last = time[index]!;
  }
  return direction !== 0;
}

function riseTimeOf(
  { time, position }: Response,
  first: number,
  end: number,
  initial: number,
  way: number,
): number | null {
  let low: number | null = null;
  for (let index = first; index < end; index++) {
    const share = (position[index]! - initial) / way;
    if (low === null && share >= RISE_FROM) low = time[index]!;
    if (low !== null && share >= RISE_TO) return time[index]! - low;
  }
  return null;
}

function overshootOf(
  position: ArrayLike<number>,
  first: number,
  end: number,
  target: number,
  direction: number,
): number {
  let most = 0;
  for (let index = first; index < end; index++)
    most = Math.max(most, (position[index]! - target) * direction);
  return most;
}

function settlingTimeOf(
  { time, position, setPoint }: Response,
  first: number,
  end: number,
  target: number,
  way: number,
): number | null {
  const band = way * SETTLING_BAND;
  let settled = end;
  while (settled > first && Math.abs(position[settled - 1]! - target) <= band) settled--;
  return settled === end ? null : Math.max(0, time[settled]! - time[motionBegin(setPoint, first, end)]!);
}

/** The sample at which the set point first changes; the first one where it never does. */
function motionBegin(setPoint: ArrayLike<number> | null, first: number, end: number): number {
  if (setPoint)
    for (let index = first + 1; index < end; index++) if (setPoint[index] !== setPoint[first]) return index;
  return first;
}

function meanOf(values: ArrayLike<number>, first: number, end: number): number {
  let sum = 0;
  for (let index = first; index < end; index++) sum += values[index]!;
  return sum / (end - first);
}

function spreadOf(values: ArrayLike<number>, first: number, end: number): number {
  let [low, high] = [Infinity, -Infinity];
  for (let index = first; index < end; index++) {
    low = Math.min(low, values[index]!);
    high = Math.max(high, values[index]!);
  }
  return high - low;
}

/** The first sample at or after a moment. */
export function indexAt(time: ArrayLike<number>, moment: number): number {
  let [low, high] = [0, time.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (time[middle]! < moment) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** One beyond the last sample at or before a moment. */
export function indexAfter(time: ArrayLike<number>, moment: number): number {
  let [low, high] = [0, time.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (time[middle]! <= moment) low = middle + 1;
    else high = middle;
  }
  return low;
}
