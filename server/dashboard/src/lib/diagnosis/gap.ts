/** How the gap between measurement and simulation shrinks, step by step, against the noise floor. */

import type { DiagnosisData, SignalError } from '../api/types';

export interface Stage {
  name: string;
  /** Whether the model was kept so; a step that was not taken leads back to the stage before. */
  kept: boolean;
  /** Root mean square by joint, in the joint's unit; in the order of the joints. */
  fit: readonly number[];
  held: readonly number[] | null;
}

export interface Gap {
  joints: readonly number[];
  units: readonly string[];
  floor: readonly number[];
  stages: readonly Stage[];
}

/** The stages of a diagnosis: the model as given, its tolerances fitted, every step. */
export function gapOf(found: DiagnosisData): Gap {
  const overall = found.rmse_fit;
  const steps = found.steps.filter((step) => step.effect !== null && step.where.cells.length > 0);
  const before = (errors: readonly SignalError[]): number[] => errors.map((one) => one.before);
  const after = (errors: readonly SignalError[]): number[] => errors.map((one) => one.after);
  const held = (errors: readonly SignalError[], pick: typeof before): number[] | null =>
    errors.length === 0 ? null : pick(errors);
  const stages: Stage[] = [];
  if (overall.length > 0) {
    stages.push({
      name: 'as given',
      kept: true,
      fit: before(overall),
      held: held(found.rmse_holdout, before),
    });
  }
  const first = steps[0];
  if (first !== undefined) {
    stages.push({
      name: 'tolerances fitted',
      kept: true,
      fit: before(first.rmse_fit),
      held: held(first.rmse_holdout, before),
    });
  } else if (overall.length > 0) {
    stages.push({
      name: 'tolerances fitted',
      kept: true,
      fit: after(overall),
      held: held(found.rmse_holdout, after),
    });
  }
  for (const step of steps) {
    stages.push({
      name: `+ ${step.called}`,
      kept: step.adopted,
      fit: after(step.rmse_fit),
      held: held(step.rmse_holdout, after),
    });
  }
  const source = overall.length > 0 ? overall : (first?.rmse_fit ?? []);
  return {
    joints: source.map((one) => one.joint),
    units: source.map((one) => one.unit),
    floor: source.map((one) => one.floor),
    stages,
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
