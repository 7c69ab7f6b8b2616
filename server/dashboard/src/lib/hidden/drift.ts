/**
 * How a recorded and a simulated arm drift apart: what is drawn of an overlay at a moment, with the difference enlarged
 * so that it can be seen. Angles in rad, times in s. Pure.
 */

import type { Overlay } from '../api/types';

/** s over which a moment is averaged: an overlay is thinned to extremes, which would tremble. */
const AVERAGED = 0.4;
/** s over which a joint's heat is judged. */
const JUDGED = 1.5;
/** How far apart the arms are drawn where they differ most, rad. */
const DRAWN = 0.24;
/** The difference reaches that at this share of its values. */
const NEARLY_ALL = 0.98;
const ROUND = [1, 2, 5, 10, 20, 50, 100, 200];
/** Times its noise at which a joint is as hot as it gets, and at which it begins to be. */
const HOTTEST = 5;
const WARM = 1.3;

/**
 * An overlay on an even grid. `posture[joint][index]`, `gap[model][joint][index]`: recorded − simulated, as it is drawn;
 * `square`: its mean square, which has what trembles too, as the errors of an answer have.
 */
export interface Drift {
  readonly joints: readonly number[];
  readonly step: number;
  readonly duration: number;
  readonly posture: readonly (readonly number[])[];
  readonly gap: readonly (readonly (readonly number[])[])[];
  readonly square: readonly (readonly (readonly number[])[])[];
}

/** `step`: s between two moments of the grid. */
export function driftOf(one: Overlay, step = 0.05): Drift {
  const duration = one.time.at(-1) ?? 0;
  const count = Math.max(1, Math.floor(duration / step) + 1);
  const even = (row: readonly (number | null)[]): number[] => averaged(one.time, row, count, step);
  return {
    joints: one.joints,
    step,
    duration,
    posture: one.measured.map(even),
    gap: one.residual.map((rows) => rows.map(even)),
    square: one.residual.map((rows) =>
      rows.map((row) => even(row.map((value) => (value === null ? null : value ** 2)))),
    ),
  };
}

/** How many times the difference to the first model is enlarged: a round number. */
export function enlargementOf(drift: Drift): number {
  const sizes = (drift.gap[0] ?? [])
    .flat()
    .map(Math.abs)
    .sort((a, b) => a - b);
  const most = sizes[Math.floor(NEARLY_ALL * (sizes.length - 1))] ?? 0;
  return ROUND.filter((one) => one * most <= DRAWN).at(-1) ?? 1;
}

/**
 * Recorded and simulated values of the joints at a moment. `closed`: 0 with the first model, 1 with the second; between
 * them the gap closes.
 */
export function armsAt(
  drift: Drift,
  moment: number,
  enlarged: number,
  closed: number,
): { recorded: number[]; simulated: number[] } {
  const recorded = drift.posture.map((row) => valueAt(row, drift.step, moment));
  const simulated = recorded.map(
    (value, joint) => value - enlarged * between(drift.gap, drift.step, joint, moment, closed),
  );
  return { recorded, simulated };
}

/** By joint: 0 where the difference is no more than its noise, 1 where it is several times as large. */
export function heatAt(drift: Drift, noise: readonly number[], moment: number, closed: number): number[] {
  return timesNoiseAt(drift, noise, moment, closed).map((times) =>
    Math.min(1, Math.max(0, (times - WARM) / (HOTTEST - WARM))),
  );
}

/** By joint: how many times its noise the difference is, over the last moments. */
export function timesNoiseAt(
  drift: Drift,
  noise: readonly number[],
  moment: number,
  closed: number,
): number[] {
  return drift.joints.map((_, joint) => {
    const steps = Math.round(JUDGED / drift.step);
    const values = Array.from({ length: steps }, (__, back) =>
      between(drift.square, drift.step, joint, Math.max(0, moment - back * drift.step), closed),
    );
    const rms = Math.sqrt(values.reduce((sum, value) => sum + value, 0) / Math.max(1, steps));
    return rms / (noise[joint] || Infinity);
  });
}

/** A value by model and joint at a moment, between that of the first model and that of the second. */
function between(
  rows: readonly (readonly (readonly number[])[])[],
  step: number,
  joint: number,
  moment: number,
  closed: number,
): number {
  const [before, after] = [rows[0]?.[joint] ?? [], rows[1]?.[joint] ?? rows[0]?.[joint] ?? []];
  return (1 - closed) * valueAt(before, step, moment) + closed * valueAt(after, step, moment);
}

function valueAt(row: readonly number[], step: number, moment: number): number {
  const place = Math.min(row.length - 1, Math.max(0, moment / step));
  const low = Math.floor(place);
  const first = row[low] ?? 0;
  return first + (place - low) * ((row[low + 1] ?? first) - first);
}

function averaged(
  time: readonly number[],
  row: readonly (number | null)[],
  count: number,
  step: number,
): number[] {
  const found: number[] = [];
  let from = 0;
  for (let index = 0; index < count; index++) {
    const at = index * step;
    while (from < time.length - 1 && time[from]! < at - AVERAGED / 2) from++;
    let [sum, number] = [0, 0];
    for (let place = from; place < time.length && time[place]! <= at + AVERAGED / 2; place++) {
      const value = row[place] ?? null;
      if (value === null) continue;
      sum += value;
      number++;
    }
    found.push(number > 0 ? sum / number : (found.at(-1) ?? 0));
  }
  return found;
}
