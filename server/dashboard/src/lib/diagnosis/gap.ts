/** How the gap between measurement and simulation shrinks, step by step, against the noise floor. */

import type { DiagnosisData, SignalError } from '../api/types';
import { candidateName } from './words';

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
      name: `+ ${candidateName({ effect: step.effect ?? '', joints: step.joints })}`,
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

/** A place from 0 to 1 on a logarithmic scale between two errors. */
export function logPlace(value: number, low: number, high: number): number {
  if (!(low > 0) || !(high > low)) return 0;
  return Math.min(1, Math.max(0, Math.log(Math.max(value, low) / low) / Math.log(high / low)));
}

/** Round bounds of a logarithmic scale that holds all of these values: 1, 2 or 5 times a power of ten. */
export function logBounds(values: readonly number[]): [number, number] {
  const own = values.filter((value) => value > 0);
  if (own.length === 0) return [0.1, 1];
  const low = roundDown(Math.min(...own) / 1.1);
  const high = roundUp(Math.max(...own) * 1.1);
  return [low, high > low ? high : low * 10];
}

/** The round values between two bounds. */
export function logTicks(low: number, high: number): number[] {
  const ticks: number[] = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); power += 1) {
    for (const digit of [1, 2, 5]) {
      const value = digit * 10 ** power;
      if (value >= low * 0.999 && value <= high * 1.001) ticks.push(Number(value.toPrecision(3)));
    }
  }
  return ticks;
}

const ROUND = [1, 2, 5, 10];

function roundDown(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * (ROUND.findLast((digit) => digit * power <= value * 1.0001) ?? 1);
}

function roundUp(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * (ROUND.find((digit) => digit * power >= value * 0.9999) ?? 10);
}
