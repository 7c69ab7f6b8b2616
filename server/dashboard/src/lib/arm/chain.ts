/**
 * Where the links of the arm are: forward kinematics of its Denavit–Hartenberg chain (standard convention, section 3.2
 * of the source). Lengths in m, angles in rad, in the frame of the base: z is up.
 */

export type Vector = readonly [number, number, number];

/** Origin and axes of a link's frame, in the base frame. */
export interface Frame {
  readonly origin: Vector;
  readonly x: Vector;
  readonly y: Vector;
  readonly z: Vector;
}

/** One joint: its constant Denavit–Hartenberg parameters. */
export interface ChainJoint {
  readonly name: string;
  readonly revolute: boolean;
  readonly a: number;
  readonly alpha: number;
  readonly d: number;
  readonly theta: number;
}

export type Chain = readonly ChainJoint[];

/** What is needed of the machine file as the service sends it. */
export interface MachineGeometry {
  readonly joints: readonly {
    readonly name: string;
    readonly kind: 'revolute' | 'prismatic';
    readonly geometry: Readonly<Record<'a' | 'alpha' | 'd' | 'theta', { readonly value: number }>>;
  }[];
  readonly rest_posture?: readonly number[] | null;
}

export const BASE: Frame = {
  origin: [0, 0, 0],
  x: [1, 0, 0],
  y: [0, 1, 0],
  z: [0, 0, 1],
};

export function chainOf(machine: MachineGeometry): Chain {
  return machine.joints.map((joint) => ({
    name: joint.name,
    revolute: joint.kind === 'revolute',
    a: joint.geometry.a.value,
    alpha: joint.geometry.alpha.value,
    d: joint.geometry.d.value,
    theta: joint.geometry.theta.value,
  }));
}

/** Frames of all links for a posture: one value a joint, rad (m on a prismatic joint). */
export function framesOf(chain: Chain, posture: readonly number[]): Frame[] {
  if (posture.length !== chain.length) {
    throw new RangeError(`a posture of ${posture.length} values for ${chain.length} joints`);
  }
  const frames: Frame[] = [];
  let frame = BASE;
  chain.forEach((joint, index) => {
    frame = nextFrame(frame, joint, posture[index]!);
    frames.push(frame);
  });
  return frames;
}

/** Where the last link ends. */
export function tipOf(chain: Chain, posture: readonly number[]): Vector {
  return framesOf(chain, posture).at(-1)?.origin ?? BASE.origin;
}

/** The chain stretched out, in m: no end of a link is ever further from the base. */
export function reachOf(chain: Chain): number {
  return chain.reduce((sum, joint) => sum + Math.hypot(joint.a, joint.revolute ? joint.d : 0), 0);
}

/** The rest posture, with the values of some joints (numbers from 1) in their places. */
export function postureWith(
  machine: MachineGeometry,
  joints: readonly number[],
  values: readonly number[],
): number[] {
  const posture = machine.joints.map((_, index) => machine.rest_posture?.[index] ?? 0);
  joints.forEach((joint, index) => {
    if (joint <= posture.length) posture[joint - 1] = values[index] ?? posture[joint - 1]!;
  });
  return posture;
}

/** T = Rot(z, θ) Trans(0, 0, d) Trans(a, 0, 0) Rot(x, α), equation (3.2). */
function nextFrame(frame: Frame, joint: ChainJoint, value: number): Frame {
  const theta = joint.theta + (joint.revolute ? value : 0);
  const d = joint.d + (joint.revolute ? 0 : value);
  const [cosTheta, sinTheta] = [Math.cos(theta), Math.sin(theta)];
  const [cosAlpha, sinAlpha] = [Math.cos(joint.alpha), Math.sin(joint.alpha)];
  const x = combined(frame.x, cosTheta, frame.y, sinTheta);
  const across = combined(frame.x, -sinTheta, frame.y, cosTheta);
  return {
    origin: combined(combined(frame.origin, 1, x, joint.a), 1, frame.z, d),
    x,
    y: combined(across, cosAlpha, frame.z, sinAlpha),
    z: combined(across, -sinAlpha, frame.z, cosAlpha),
  };
}

/** p · a + q · b. */
function combined(a: Vector, p: number, b: Vector, q: number): Vector {
  return [p * a[0] + q * b[0], p * a[1] + q * b[1], p * a[2] + q * b[2]];
}
