import { describe, expect, it } from 'vitest';
import type { Chain } from './chain';
import { armInWords } from './words';

const JOINT = { alpha: 0, d: 0, theta: 0 };
const CHAIN: Chain = [
  { ...JOINT, name: 'waist', revolute: true, a: 0.5 },
  { ...JOINT, name: 'slide', revolute: false, a: 0 },
];

describe('the arm in words', () => {
  it('tells the end in mm and every joint in its unit', () => {
    expect(armInWords(CHAIN, [Math.PI / 2, 0.0123])).toBe(
      'End of the arm at x 0, y 500, z 12 mm. Joints: 1 waist 90.0°, 2 slide 12.3 mm.',
    );
  });

  it('has a true minus sign, and none before nothing', () => {
    expect(armInWords(CHAIN, [Math.PI, -1e-9])).toBe(
      'End of the arm at x −500, y 0, z 0 mm. Joints: 1 waist 180.0°, 2 slide 0.0 mm.',
    );
  });

  it('says that it is old, or unknown', () => {
    expect(armInWords(CHAIN, [0, 0], 'Not live.')).toMatch(/^Not live\. End/);
    expect(armInWords(CHAIN, null)).toBe('The posture of the arm is not known.');
  });
});
