/** A sample's angles as the posture of a whole machine. Pure. */

import type { SampleMessage } from '../api/types';

/** One value a joint of the machine, rad; null where a joint is not in the sample. */
export function postureOf(
  sample: SampleMessage | null,
  signal: 'position' | 'set_point',
  joints: number,
): number[] | null {
  if (sample === null) return null;
  const posture: number[] = [];
  for (let joint = 1; joint <= joints; joint += 1) {
    const value = sample[signal][sample.joints.indexOf(joint)];
    if (value === undefined) return null;
    posture.push(value);
  }
  return posture;
}
