/** The picture of the arm in words, for people who do not see it. */

import { fixed } from '../format';
import { tipOf, type Chain } from './chain';

/**
 * One line: where the end is (mm) and how every joint stands (°, mm on a prismatic one). `old`: what is said first of a
 * posture that is not that of now.
 */
export function armInWords(chain: Chain, posture: readonly number[] | null, old = ''): string {
  if (posture === null) return 'The posture of the arm is not known.';
  const [x, y, z] = tipOf(chain, posture).map((value) => fixed(value * 1000, 0));
  const joints = chain.map((joint, index) => {
    const value = posture[index]!;
    const text = joint.revolute ? `${fixed((value * 180) / Math.PI, 1)}°` : `${fixed(value * 1000, 1)} mm`;
    return `${index + 1} ${joint.name} ${text}`;
  });
  return `${old === '' ? '' : `${old} `}End of the arm at x ${x}, y ${y}, z ${z} mm. Joints: ${joints.join(', ')}.`;
}
