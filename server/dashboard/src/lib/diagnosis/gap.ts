/** How the gap between measurement and simulation shrinks, step by step, against the noise floor. */

import type { DiagnosisData } from '../api/types';

export interface Stage {
  name: string;
  /** Root mean square by joint, in the joint's unit, in the order of the joints; null where it is not finite. */
  fit: readonly (number | null)[];
  held: readonly (number | null)[] | null;
}

export interface Gap {
  joints: readonly number[];
  units: readonly string[];
  floor: readonly number[];
  stages: readonly Stage[];
}

/** The stages of a diagnosis: the model as given, its tolerances fitted, every effect that was added. */
export function gapOf(found: DiagnosisData): Gap {
  const gap = found.gap;
  if (!gap) return { joints: [], units: [], floor: [], stages: [] };
  return {
    joints: gap.joints,
    units: gap.units,
    floor: gap.noise,
    stages: gap.stages.map((stage) => ({
      name: stage.name,
      fit: stage.fitted,
      held: stage.held_out.length === 0 ? null : stage.held_out,
    })),
  };
}

/** Share of the variance beyond noise that is gone; null where there was hardly any. */
export function goneOf(before: number, after: number, floor: number): number | null {
  if (before < 1.5 * floor) return null;
  return (before ** 2 - after ** 2) / (before ** 2 - floor ** 2);
}

/** Round values from 0 to beyond the largest of these: the ticks of an axis, the last one its end. */
export function ticksFromZero(values: readonly number[]): number[] {
  const most = Math.max(0, ...values);
  if (most === 0) return [0, 1];
  const step = roundUp(most / 4);
  const count = Math.ceil((most * 1.05) / step);
  return Array.from({ length: count + 1 }, (_, index) => Number((index * step).toPrecision(3)));
}

const ROUND = [1, 2, 5, 10];

function roundUp(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * (ROUND.find((digit) => digit * power >= value * 0.9999) ?? 10);
}
