/** Leading by hand: which joints can be led, and how they are called. */

import type { Machine } from '../api/types';

/** Those whose position is measured: the set point of a led joint follows the hand. */
export function canBeLed(machine: Machine): number[] {
  return machine.joints.flatMap((joint, index) => (joint.sensor === null ? [] : [index + 1]));
}

/** Those that are led unless others are chosen: the ones whose motion the machine file describes. */
export function ledAtFirst(machine: Machine): number[] {
  return canBeLed(machine).filter((joint) => machine.modelled_joints.includes(joint));
}

/** `joint 2`, `joints 1 and 3`, `joints 1 to 3`; without any, `the led joints`. */
export function jointsInWords(joints: readonly number[]): string {
  const [first] = joints;
  const last = joints.at(-1);
  if (first === undefined || last === undefined) return 'the led joints';
  if (joints.length === 1) return `joint ${first}`;
  if (joints.length > 2 && last - first === joints.length - 1) return `joints ${first} to ${last}`;
  return `joints ${joints.slice(0, -1).join(', ')} and ${last}`;
}
