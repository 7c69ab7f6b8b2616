/** A previewed motion as curves and as a way through space, with what speaks against it in its place. */

import { framesOf, type Chain, type Vector } from '../arm/chain';
import { fixed } from '../format';
import { DEGREES } from './fields';

/** What the service answers; angles in rad, one row a moment, one column a joint of the machine. */
export interface Motion {
  readonly time: readonly number[];
  readonly set_points: readonly (readonly number[])[];
  readonly moving: readonly number[];
  readonly duration: number;
  readonly violations: readonly Violation[];
}

export interface Violation {
  readonly rule: string;
  readonly joint: number;
  readonly time: number;
  readonly value: number | null;
  readonly limit: number | null;
  readonly message: string;
}

export interface MotionLimits {
  readonly joints?: readonly { readonly low?: number | null; readonly high?: number | null }[];
  readonly floor_height?: number | null;
  readonly reach?: number | null;
}

export interface Curve {
  readonly joint: number;
  /** Degrees, one a moment. */
  readonly values: number[];
  readonly low: number | null;
  readonly high: number | null;
}

export interface Way {
  /** Where the last link's end goes, at some of the moments. */
  readonly points: readonly Vector[];
  readonly times: readonly number[];
  /** Whether the posture at that point is outside of what is allowed. */
  readonly outside: readonly boolean[];
}

const MOST_POINTS = 1200;

/** One curve for every joint that moves, in degrees. */
export function curvesOf(motion: Motion, limits: MotionLimits): Curve[] {
  return motion.moving.map((joint) => {
    const own = limits.joints?.[joint - 1];
    return {
      joint,
      values: motion.set_points.map((row) => row[joint - 1]! * DEGREES),
      low: own?.low == null ? null : own.low * DEGREES,
      high: own?.high == null ? null : own.high * DEGREES,
    };
  });
}

/** What each joint that moves does, a line each: between which values, how fast, how near to an end of its range. */
export function movesInWords(
  motion: Motion,
  joints: readonly { readonly kind: string }[],
  limits: MotionLimits,
): string[] {
  return curvesOf(motion, limits).map(({ joint, values, low, high }) => {
    const isLong = joints[joint - 1]?.kind === 'prismatic';
    const [scale, unit] = isLong ? [1000 / DEGREES, ' mm'] : [1, '°'];
    const told = (value: number): string => `${fixed(value * scale, 1)}${unit}`;
    const [least, most] = [Math.min(...values), Math.max(...values)];
    const speeds = values
      .slice(1)
      .map(
        (value, index) => Math.abs(value - values[index]!) / (motion.time[index + 1]! - motion.time[index]!),
      );
    const margin = Math.min((high ?? Infinity) - most, least - (low ?? -Infinity));
    const room = Number.isFinite(margin) ? `, ${told(margin)} to the end of its range` : '';
    return `joint ${joint}: from ${told(values[0]!)}, between ${told(least)} and ${told(most)}, set points at most ${told(Math.max(0, ...speeds))}/s${room}`;
  });
}

/** The way of the arm's end, at `MOST_POINTS` moments at most. */
export function wayOf(motion: Motion, chain: Chain, limits: MotionLimits): Way {
  const every = Math.max(1, Math.ceil(motion.set_points.length / MOST_POINTS));
  const points: Vector[] = [];
  const times: number[] = [];
  const outside: boolean[] = [];
  for (let row = 0; row < motion.set_points.length; row += every) {
    const posture = motion.set_points[row]!;
    const ends = framesOf(chain, posture).map((frame) => frame.origin);
    points.push(ends.at(-1)!);
    times.push(motion.time[row]!);
    outside.push(isOutside(posture, ends, limits));
  }
  return { points, times, outside };
}

/** The posture at a moment (s), straight between the moments that are known. */
export function postureAt(motion: Motion, moment: number): number[] {
  const { time, set_points: rows } = motion;
  const after = time.findIndex((one) => one >= moment);
  if (after === -1) return [...(rows.at(-1) ?? [])];
  if (after === 0) return [...(rows[0] ?? [])];
  const [begin, end] = [time[after - 1]!, time[after]!];
  const share = (moment - begin) / (end - begin);
  return rows[after]!.map((value, joint) => {
    const before = rows[after - 1]![joint]!;
    return before + share * (value - before);
  });
}

function isOutside(posture: readonly number[], ends: readonly Vector[], limits: MotionLimits): boolean {
  const joints = limits.joints ?? [];
  const beyond = posture.some((value, index) => {
    const { low, high } = joints[index] ?? {};
    return (low != null && value < low) || (high != null && value > high);
  });
  const { floor_height: floor, reach } = limits;
  return (
    beyond ||
    (floor != null && ends.some((end) => end[2] < floor)) ||
    (reach != null && ends.some((end) => Math.hypot(...end) > reach))
  );
}
