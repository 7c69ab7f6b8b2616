/** What would have to move with time: the distortion method's α(t), ready to be drawn. */

import type { ValidationData } from '../api/types';

export type TimeDomain = ValidationData['time_domain'][number];
export type Variation = TimeDomain['parameters'][number];

export interface VariationPicture {
  name: string;
  unit: string;
  /** Points of lines in a square of 0 to 1, y downwards; zero in the middle. */
  lines: [number, number][][];
  /** Half the height of the band of what is expected, as a share of the height. */
  expected: number;
  deviation: number;
  expectedDeviation: number;
  within: boolean;
  /** Shares of the residual's energy that it explains by itself. */
  constant: number;
  varying: number;
  goesWith: string;
}

/** Times what independent signals would show, beyond which a correlation counts. */
const SIGNIFICANT = 3;

/** The parameters that explain most by moving, at most so many. */
export function variationPictures(found: TimeDomain, most: number): VariationPicture[] {
  return [...found.parameters]
    .sort((one, other) => other.alone_varying - one.alone_varying)
    .slice(0, most)
    .map((one) => pictureOf(one, found.time));
}

function pictureOf(one: Variation, time: readonly number[]): VariationPicture {
  const known = one.values.filter((value) => value !== null).map(Math.abs);
  const largest = Math.max(2 * one.expected, ...known) || 1;
  const begin = time[0] ?? 0;
  const span = (time.at(-1) ?? 1) - begin || 1;
  const lines: [number, number][][] = [[]];
  one.values.forEach((value, index) => {
    if (value === null) {
      if ((lines.at(-1) ?? []).length > 0) lines.push([]);
    } else {
      lines.at(-1)?.push([((time[index] ?? 0) - begin) / span, 0.5 - (0.47 * value) / largest]);
    }
  });
  const strongest = one.against.find((against) => Math.abs(against.value) > SIGNIFICANT * against.noise);
  return {
    name: one.name,
    unit: one.unit,
    lines: lines.filter((line) => line.length > 1),
    expected: (0.47 * one.expected) / largest,
    deviation: one.deviation,
    expectedDeviation: one.expected,
    within: one.deviation <= one.expected,
    constant: one.alone_constant,
    varying: one.alone_varying,
    goesWith: strongest === undefined ? '' : `${strongest.regressor} of joint ${strongest.joint}`,
  };
}
