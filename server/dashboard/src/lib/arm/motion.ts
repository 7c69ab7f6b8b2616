/** How far an arm has moved between two pictures: what moves less than a pixel is not drawn anew. Lengths in m. Pure. */

import { framesOf, type Chain, type Vector } from './chain';

/** Points that move whenever anything of the arm does: ends of links, and two of a hand of this size. */
export function outlineOf(chain: Chain, posture: readonly number[], hand: number): Vector[] {
  const frames = framesOf(chain, posture);
  const last = frames.at(-1);
  const ends = frames.map((frame) => frame.origin);
  return last ? [...ends, beyond(last.origin, last.x, hand), beyond(last.origin, last.y, hand)] : ends;
}

/** The longest way of any point; infinite where one of the two is not there. */
export function farthest(one: readonly Vector[] | null, other: readonly Vector[] | null): number {
  if (one === null || other === null || one.length !== other.length) return one === other ? 0 : Infinity;
  return one.reduce((most, point, index) => Math.max(most, distance(point, other[index]!)), 0);
}

/** m that a pixel shows at the middle of the picture. `fieldOfView`: vertical, rad; `height`: of the picture, px. */
export function metresOfPixel(distance: number, fieldOfView: number, height: number): number {
  return (2 * distance * Math.tan(fieldOfView / 2)) / Math.max(1, height);
}

function beyond(origin: Vector, axis: Vector, length: number): Vector {
  return [origin[0] + length * axis[0], origin[1] + length * axis[1], origin[2] + length * axis[2]];
}

function distance(one: Vector, other: Vector): number {
  return Math.hypot(one[0] - other[0], one[1] - other[1], one[2] - other[2]);
}
