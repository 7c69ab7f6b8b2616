/** How position and set point of the joints that moved have changed since the start, as columns of one chart. Pure. */

import type { TraceDetails } from '../api';
import type { ChartSeries } from '../chart';
import { dashesOf } from '../drawing/dashes';
import { columnOf, startOf, type Signals } from './columns';

export interface Response {
  readonly joints: readonly number[];
  readonly unit: string;
  readonly series: ChartSeries[];
  readonly data: [number[], ...number[][]];
}

const SCALES: Readonly<Record<string, number>> = { '°': 180 / Math.PI, mm: 1000 };

/** In the unit of the first joint; joints of another unit have no place in the same chart. Null where none moved. */
export function responseOf(
  signals: Signals,
  moved: readonly Pick<TraceDetails['figures'][number], 'joint' | 'unit'>[],
  colourOf: (joint: number) => string,
): Response | null {
  const unit = moved[0]?.unit;
  if (unit === undefined) return null;
  const joints = moved.filter((one) => one.unit === unit).map((one) => one.joint);
  const series: ChartSeries[] = [];
  const data: [number[], ...number[][]] = [[...signals.time]];
  for (const [place, joint] of joints.entries()) {
    const colour = colourOf(joint);
    for (const name of ['position', 'set_point'] as const) {
      const values = columnOf(signals, name, joint, SCALES[unit] ?? 1, startOf(signals, joint));
      if (values === null) continue;
      const isPosition = name === 'position';
      series.push({
        label: `J${joint} ${isPosition ? 'position' : 'set point'}`,
        colour,
        ...(isPosition ? { end: `J${joint}` } : { dash: dashesOf(place, joints.length), width: 1.25 }),
      });
      data.push(values);
    }
  }
  return { joints, unit, series, data };
}
