/**
 * The hand as it is drawn: a symbol. The machine file takes the wrist as a point, so its shape and size are the
 * drawing's own; only its direction comes from the joints.
 */

import type { Chain, Frame, Vector } from './chain';

export interface HandPose {
  readonly origin: Vector;
  /** Unit vectors: where the hand points, and across which its fingers close. */
  readonly forward: Vector;
  readonly across: Vector;
}

/**
 * Direction of the hand. Where the last joints have links without length, the last of them rolls the hand about the
 * direction that the ones before give it; elsewhere the hand is the last link's continuation.
 */
export function handPose(chain: Chain, posture: readonly number[], frames: readonly Frame[]): HandPose {
  const last = frames.length - 1;
  const own = frames[last]!;
  if (last < 1 || !isPoint(chain, last) || !isPoint(chain, last - 1)) {
    return { origin: own.origin, forward: own.x, across: own.y };
  }
  const wrist = frames[last - 1]!;
  const [cos, sin] = [Math.cos(posture[last]!), Math.sin(posture[last]!)];
  const across = [0, 1, 2].map((i) => cos * wrist.y[i]! + sin * wrist.z[i]!) as unknown as Vector;
  return { origin: own.origin, forward: wrist.x, across };
}

function isPoint(chain: Chain, index: number): boolean {
  const joint = chain[index]!;
  return joint.a === 0 && joint.d === 0 && joint.revolute;
}
