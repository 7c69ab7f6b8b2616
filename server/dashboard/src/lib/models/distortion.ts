/** The distortion method in pictures: Σλ² as a bar of contributions, and curves of the error against a parameter. */

import type { Fidelity } from '../api/types';
import type { Words } from './parameters';

export type Distortion = Fidelity['parameters'][number];
export type Curve = Fidelity['curves'][number];

export interface Contribution {
  name: string;
  /** The joint or link that the parameter belongs to; null for others. */
  joint: number | null;
  value: number;
  /** 0 to 1 along the bar. */
  begin: number;
  end: number;
}

export interface ContributionBar {
  parts: Contribution[];
  total: number;
  /** Where the bar ends: 1, or the sum where that is more. */
  scale: number;
  /** Where 1 lies, from 0 to 1: from there on, deviations as large as expected explain what is left. */
  one: number;
}

/** The largest contributions one after the other, the rest as one part. */
export function contributionBar(
  parameters: readonly Distortion[],
  words: Words,
  most: number,
): ContributionBar {
  const ranked = parameters
    .filter((one) => one.contribution > 0)
    .sort((one, other) => other.contribution - one.contribution);
  const total = ranked.reduce((sum, one) => sum + one.contribution, 0);
  const scale = Math.max(1, total);
  const shown = ranked.slice(0, most).map((one) => ({
    name: one.name,
    joint: words[one.name]?.joint ?? null,
    value: one.contribution,
  }));
  const left = ranked.slice(most);
  if (left.length > 0) {
    shown.push({
      name: `${left.length} more`,
      joint: null,
      value: left.reduce((sum, one) => sum + one.contribution, 0),
    });
  }
  let place = 0;
  const parts = shown.map((one) => {
    const begin = place;
    place += one.value / scale;
    return { ...one, begin, end: place };
  });
  return { parts, total, scale, one: 1 / scale };
}

/** A curve is drawn up to so many times its least error. */
export const CURVE_TOP = 4;

export interface CurvePicture {
  name: string;
  unit: string;
  /** Points of lines, in a square of 0 to 1, y downwards; a line ends where a simulation diverged. */
  lines: [number, number][][];
  /** Where the parameter's value lies, 0 to 1. */
  value: number;
  /** What is expected of it: from, to; 0 to 1. */
  expected: [number, number];
  /** Twice the least error, y downwards. */
  doubled: number;
  low: number;
  high: number;
  /** No change within its bounds doubles the error. */
  flat: boolean;
}

/** The curve of one parameter, ready to be drawn. Null where it has no width. */
export function curvePicture(curve: Curve, found: Fidelity): CurvePicture | null {
  const own = found.parameters.find((one) => one.name === curve.name);
  const low = curve.values[0];
  const high = curve.values.at(-1);
  if (own === undefined || low === undefined || high === undefined || !(high > low)) return null;
  const across = (value: number): number => Math.min(1, Math.max(0, (value - low) / (high - low)));
  const lines: [number, number][][] = [[]];
  curve.values.forEach((value, index) => {
    const error = curve.errors[index] ?? null;
    if (error === null || found.error <= 0) {
      if ((lines.at(-1) ?? []).length > 0) lines.push([]);
      return;
    }
    const height = Math.min(CURVE_TOP * 1.5, error / found.error);
    lines.at(-1)?.push([across(value), 1 - height / CURVE_TOP]);
  });
  return {
    name: curve.name,
    unit: curve.unit,
    lines: lines.filter((line) => line.length > 1),
    value: across(own.value),
    expected: [across(own.value - own.expected), across(own.value + own.expected)],
    doubled: 1 - 2 / CURVE_TOP,
    low,
    high,
    flat: own.required === null,
  };
}

/** Points of a line for SVG, in a picture of that size. */
export function pathOf(line: readonly (readonly [number, number])[], width: number, height: number): string {
  return line
    .map(([x, y], index) => `${index === 0 ? 'M' : 'L'}${(x * width).toFixed(1)} ${(y * height).toFixed(1)}`)
    .join('');
}
