/** In which unit a signal of a joint is shown. Inside everything is rad, m and V. Pure. */

import type { Machine } from '../api/types';
import type { Signal } from './recording';

export type AngleUnit = '°' | 'rad';

export interface Shown {
  unit: string;
  /** What a value is multiplied with. */
  factor: number;
  digits: number;
  /** Least height of a chart in this unit: noise of one count must not look like motion. */
  least: number;
}

const DEGREES = 180 / Math.PI;

const ANGLES: Record<AngleUnit, Record<'position' | 'error', Shown>> = {
  '°': {
    position: { unit: '°', factor: DEGREES, digits: 2, least: 4 },
    error: { unit: '°', factor: DEGREES, digits: 2, least: 3 },
  },
  rad: {
    position: { unit: 'rad', factor: 1, digits: 4, least: 0.07 },
    error: { unit: 'mrad', factor: 1000, digits: 1, least: 52 },
  },
};

const LENGTHS: Record<'position' | 'error', Shown> = {
  position: { unit: 'mm', factor: 1000, digits: 1, least: 10 },
  error: { unit: 'mm', factor: 1000, digits: 2, least: 2 },
};

/** How `signal` of joint `joint` (from 1) is shown. */
export function shownAs(machine: Machine, joint: number, signal: Signal, angle: AngleUnit): Shown {
  const one = machine.joints[joint - 1];
  if (signal === 'drive') {
    // A drive that is a plain gain takes torque or force; a motor is told in volts, or in the current that it takes.
    const own: Record<string, string> = { dc_motor: 'V', current: 'A' };
    const unit = own[one?.drive.kind ?? ''] ?? (one?.kind === 'prismatic' ? 'N' : 'N·m');
    return { unit, factor: 1, digits: 2, least: 16 };
  }
  const kind = signal === 'error' ? 'error' : 'position';
  return one?.kind === 'prismatic' ? LENGTHS[kind] : ANGLES[angle][kind];
}

/** The unit of a chart of several joints: "°", or "°, mm" where they differ. */
export function unitOf(
  machine: Machine,
  joints: readonly number[],
  signal: Signal,
  angle: AngleUnit,
): string {
  return [...new Set(joints.map((joint) => shownAs(machine, joint, signal, angle).unit))].join(', ');
}
