/**
 * Jogging: a joint moves while its key is held. The service drives it for 0.3 s at most, so a held key is repeated; a key
 * that is let go, a page that is left or a finger that slips away is a hold. Pure: the caller has the timer.
 */

import type { Machine } from '../api/types';

/** s between two commands while a key is held: two may be lost before the arm holds by itself. */
export const REPEAT_EVERY = 0.1;
/** Highest speed of jogging, rad/s, as of the service; a joint's own limit may be lower. */
export const TOP_SPEED = 0.35;
export const SPEEDS = [0.05, 0.1, 0.2, 0.35] as const;

/** Metres of a joint that slides for each radian of one that turns, as of the service's highest speeds of jogging. */
const SLIDE = 0.2;
/** Speed (rad/s) of a step of a joint that turns. */
const STEP_SPEED = 0.25;

/** What a speed in rad/s is multiplied with for a joint: m/s of one that slides, rad/s of one that turns. */
export function shareOf(machine: Machine, joint: number): number {
  return machine.joints[joint - 1]?.kind === 'prismatic' ? SLIDE : 1;
}

/** Speed of a step of a joint, rad/s (m/s). */
export function stepSpeedOf(machine: Machine, joint: number): number {
  return STEP_SPEED * shareOf(machine, joint);
}

/**
 * rad/s at which a joint is driven when `speed` (rad/s) is asked for; of a joint that slides the same share of its
 * highest speed, in m/s.
 */
export function speedOf(machine: Machine, joint: number, speed: number): number {
  const share = shareOf(machine, joint);
  const own = machine.limits.joints[joint - 1]?.speed ?? TOP_SPEED;
  return Math.min(speed * share, own, TOP_SPEED * share);
}

/** Keys of the keyboard: the chosen joint is driven by ← and →, chosen by its number. */
export type JogKey = { drive: -1 | 1 } | { choose: number };

export function jogKeyOf(key: string, joints: number): JogKey | null {
  if (key === 'ArrowRight') return { drive: 1 };
  if (key === 'ArrowLeft') return { drive: -1 };
  const number = Number(key);
  return key.length === 1 && number >= 1 && number <= joints ? { choose: number } : null;
}

/** Which joints are held in which direction. */
export class Held {
  private readonly directions = new Map<number, -1 | 1>();

  press(joint: number, direction: -1 | 1): void {
    this.directions.set(joint, direction);
  }

  /** Whether it was held. */
  release(joint: number): boolean {
    return this.directions.delete(joint);
  }

  releaseAll(): void {
    this.directions.clear();
  }

  get isAny(): boolean {
    return this.directions.size > 0;
  }

  directionOf(joint: number): -1 | 0 | 1 {
    return this.directions.get(joint) ?? 0;
  }

  /** The command to be sent: empty means hold. */
  velocities(machine: Machine, speed: number): Record<number, number> {
    return Object.fromEntries(
      [...this.directions].map(([joint, direction]) => [joint, direction * speedOf(machine, joint, speed)]),
    );
  }
}
