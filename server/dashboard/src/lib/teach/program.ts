/** A taught program while it is being put together: instructions in their order, and what each says. Pure. */

import type { Machine } from '../api/types';
import type { components } from '../api/schema';
import { fixed } from '../format';
import { shownAs, type AngleUnit } from '../live/units';
import { stepSpeedOf } from '../jog/jog';

export type Program = components['schemas']['Program'];
export type Instruction = Program['instructions'][number];
export type TaughtPath = components['schemas']['TaughtPath'];

const MOVE_SPEED = 0.25;
/** As the service allows. */
const FASTEST_RATE = 10;
const LONGEST_WAIT = 3600;

/** Keeps the posture that is measured now: a move to it. */
export function moveTo(
  machine: Machine,
  joints: readonly number[],
  position: readonly number[],
): Instruction {
  const angles = Object.fromEntries(joints.map((joint, index) => [joint, round(position[index] ?? 0)]));
  return { kind: 'absolute', angles, speed: Math.min(...joints.map((joint) => stepSpeedOf(machine, joint))) };
}

export function play(path: TaughtPath): Instruction {
  return { kind: 'path', path, rate: 1 };
}

/** One instruction in words. */
export function told(instruction: Instruction, machine: Machine, unit: AngleUnit): string {
  switch (instruction.kind) {
    case 'absolute':
    case 'relative': {
      const by = instruction.kind === 'relative';
      const angles = Object.entries(instruction.angles).map(([joint, angle]) => {
        const shown = shownAs(machine, Number(joint), 'position', unit);
        const sign = by && angle > 0 ? '+' : '';
        return `J${joint} ${sign}${fixed(angle * shown.factor, 1)}${shown.unit === '°' ? '' : ' '}${shown.unit}`;
      });
      return `${by ? 'Move by' : 'Move to'} ${angles.join(', ')}`;
    }
    case 'path':
      return `Play the path led by hand, ${fixed(instruction.path.times.at(-1) ?? 0, 1)} s`;
    case 'wait':
      return `Wait ${fixed(instruction.duration, 1)} s`;
    case 'output':
      return `Output ${instruction.line} ${instruction.on ? 'on' : 'off'}`;
    case 'input':
      return `Wait until input ${instruction.line} is ${instruction.on ? 'on' : 'off'}`;
    case 'gripper':
      return instruction.closed ? 'Close the gripper' : 'Open the gripper';
  }
}

/** The one number of an instruction that can be changed afterwards: how fast it moves, or how long it waits. */
export interface Adjustable {
  readonly label: string;
  readonly unit: string;
  /** As shown. */
  readonly value: number;
  readonly most: number;
  /** The instruction with another such number, as shown. */
  with(value: number): Instruction;
}

const DEGREES = 180 / Math.PI;

/** Null where an instruction has no such number. */
export function adjustable(instruction: Instruction): Adjustable | null {
  switch (instruction.kind) {
    case 'absolute':
    case 'relative':
      return {
        label: 'Speed',
        unit: '°/s',
        value: Number(((instruction.speed ?? MOVE_SPEED) * DEGREES).toFixed(1)),
        most: 3 * DEGREES,
        with: (value) => ({ ...instruction, speed: Math.min(3, value / DEGREES) }),
      };
    case 'path':
      return {
        label: 'Rate',
        unit: '×',
        value: instruction.rate ?? 1,
        most: FASTEST_RATE,
        with: (rate) => ({ ...instruction, rate }),
      };
    case 'wait':
      return {
        label: 'Duration',
        unit: 's',
        value: instruction.duration,
        most: LONGEST_WAIT,
        with: (duration) => ({ ...instruction, duration }),
      };
    default:
      return null;
  }
}

/** `list` with the instruction at `place` moved by `step`; unchanged at the ends. */
export function moved<T>(list: readonly T[], place: number, step: -1 | 1): T[] {
  const other = place + step;
  const made = [...list];
  if (place < 0 || other < 0 || place >= list.length || other >= list.length) return made;
  [made[place], made[other]] = [made[other] as T, made[place] as T];
  return made;
}

/** The program as the service takes it, and as `daq teach` reads it from a file. */
export function programOf(name: string, machine: string, instructions: readonly Instruction[]): Program {
  return { version: 1, name, machine, notes: '', instructions: [...instructions] };
}

/** Why a name is not valid; empty if it is. */
export function problemOfName(name: string): string {
  return /^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$/.test(name)
    ? ''
    : 'letters, digits, and _ . - after the first; at most 64';
}

/** To 1e-5 rad: a hundredth of what the sensors resolve. */
function round(angle: number): number {
  return Math.round(angle * 1e5) / 1e5;
}
