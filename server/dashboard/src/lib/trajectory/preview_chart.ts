/** Curves of a preview as columns of a chart, with the limits that they come near to. */

import type { ChartSeries } from '../chart';
import type { Curve } from './preview';

export interface PreviewChart {
  readonly series: ChartSeries[];
  readonly data: [number[], ...number[][]];
}

/** A limit is drawn when a curve comes within this share of its own span of it, or passes it: else it would flatten the curves. */
const NEAR = 0.35;

export function chartOf(
  time: readonly number[],
  curves: readonly Curve[],
  colourOf: (joint: number) => string,
  limitColour: string,
): PreviewChart {
  const series: ChartSeries[] = [];
  const data: [number[], ...number[][]] = [[...time]];
  for (const curve of curves) {
    series.push({ label: `J${curve.joint}`, colour: colourOf(curve.joint), end: `J${curve.joint}` });
    data.push(curve.values);
  }
  for (const { curve, limit, name } of curves.flatMap(limitsNear)) {
    series.push({ label: `J${curve.joint} ${name}`, colour: limitColour, dash: [2, 4], width: 1.25 });
    data.push(time.map(() => limit));
  }
  return { series, data };
}

function limitsNear(curve: Curve): { curve: Curve; limit: number; name: string }[] {
  let [least, most] = [Infinity, -Infinity];
  for (const value of curve.values) {
    least = Math.min(least, value);
    most = Math.max(most, value);
  }
  const near = NEAR * (most - least);
  const found = [];
  if (curve.low !== null && least < curve.low + near)
    found.push({ curve, limit: curve.low, name: 'lower limit' });
  if (curve.high !== null && most > curve.high - near)
    found.push({ curve, limit: curve.high, name: 'upper limit' });
  return found;
}
