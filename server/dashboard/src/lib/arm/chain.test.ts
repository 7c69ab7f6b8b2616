import { describe, expect, it } from 'vitest';
import { chainOf, framesOf, postureWith, reachOf, tipOf, type MachineGeometry } from './chain';
import { handPose } from './hand';

const A2 = 0.285755;
const A3 = 0.16841;
const NONE = { a: 0, alpha: 0, d: 0, theta: 0 };

function machine(
  ...rows: { a?: number; alpha?: number; d?: number; theta?: number; slides?: boolean }[]
): MachineGeometry {
  return {
    joints: rows.map(({ slides, ...row }, index) => ({
      name: `joint ${index + 1}`,
      kind: slides ? 'prismatic' : 'revolute',
      geometry: Object.fromEntries(
        Object.entries({ ...NONE, ...row }).map(([name, value]) => [name, { value }]),
      ) as MachineGeometry['joints'][number]['geometry'],
    })),
    rest_posture: rows.map((_, index) => index / 10),
  };
}

const MAJOR = machine({ alpha: Math.PI / 2 }, { a: A2 }, { a: A3 });
const WITH_WRIST = machine(
  { alpha: Math.PI / 2 },
  { a: A2 },
  { a: A3 },
  { alpha: Math.PI / 2 },
  { alpha: -Math.PI / 2 },
  {},
);

describe('forward kinematics', () => {
  it('agrees with the closed form of the three major joints (section 3.4)', () => {
    const chain = chainOf(MAJOR);
    for (const [t1, t2, t3] of [
      [0, 0, 0],
      [0.3, 1.1, -0.7],
      [3.1, 0.8, 2.2],
      [-2, -0.5, 0.1],
    ] as const) {
      const radius = A2 * Math.cos(t2) + A3 * Math.cos(t2 + t3);
      const height = A2 * Math.sin(t2) + A3 * Math.sin(t2 + t3);
      const tip = tipOf(chain, [t1, t2, t3]);
      expect(tip[0]).toBeCloseTo(radius * Math.cos(t1), 12);
      expect(tip[1]).toBeCloseTo(radius * Math.sin(t1), 12);
      expect(tip[2]).toBeCloseTo(height, 12);
    }
  });

  it('stands straight up at θ2 = 90°', () => {
    expect(tipOf(chainOf(MAJOR), [1, Math.PI / 2, 0])[2]).toBeCloseTo(A2 + A3, 12);
  });

  it('keeps every frame right-handed and of unit length, and every link as long as it is', () => {
    const chain = chainOf(WITH_WRIST);
    const frames = framesOf(chain, [0.2, 0.9, -1.3, 0.4, -0.8, 2.5]);
    let before: readonly number[] = [0, 0, 0];
    frames.forEach(({ origin, x, y, z }, index) => {
      expect(x[1] * y[2] - x[2] * y[1]).toBeCloseTo(z[0], 12);
      expect(x[2] * y[0] - x[0] * y[2]).toBeCloseTo(z[1], 12);
      expect(Math.hypot(...x)).toBeCloseTo(1, 12);
      expect(Math.hypot(...origin.map((value, i) => value - before[i]!))).toBeCloseTo(chain[index]!.a, 12);
      before = origin;
    });
  });

  it('moves a prismatic joint along its axis', () => {
    const chain = chainOf(machine({ alpha: Math.PI / 2 }, { slides: true, d: 0.1 }));
    expect(tipOf(chain, [0, 0.25])[1]).toBeCloseTo(-0.35, 12);
    expect(reachOf(chain)).toBe(0);
  });

  it('refuses a posture of another number of joints', () => {
    expect(() => tipOf(chainOf(MAJOR), [0, 0])).toThrow('2 values for 3 joints');
  });
});

describe('a posture from some joints', () => {
  it('leaves the others at rest', () => {
    expect(postureWith(MAJOR, [1, 3], [5, 7])).toEqual([5, 0.1, 7]);
  });
});

describe('the hand', () => {
  it('continues the last link while the wrist is straight, and rolls about itself', () => {
    const chain = chainOf(WITH_WRIST);
    for (const roll of [0, 1.2]) {
      const posture = [0.5, 0.6, 0.7, 0, 0, roll];
      const frames = framesOf(chain, posture);
      const hand = handPose(chain, posture, frames);
      hand.forward.forEach((value, i) => expect(value).toBeCloseTo(frames[2]!.x[i]!, 12));
      expect(hand.forward.reduce((sum, value, i) => sum + value * hand.across[i]!, 0)).toBeCloseTo(0, 12);
    }
  });

  it('points where pitch points it', () => {
    const chain = chainOf(WITH_WRIST);
    const posture = [0, 0, 0, Math.PI / 2, 0, 0];
    expect(handPose(chain, posture, framesOf(chain, posture)).forward[2]).toBeCloseTo(1, 12);
  });

  it('continues the last link of an arm without a wrist', () => {
    const chain = chainOf(MAJOR);
    const frames = framesOf(chain, [0, 0.4, 0.3]);
    expect(handPose(chain, [0, 0.4, 0.3], frames).forward).toEqual(frames[2]!.x);
  });
});
