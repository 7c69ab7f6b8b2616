/**
 * Whether what became of a stop still holds: no message may outlive what it says. Pure; times in s, of any clock that
 * only goes forward.
 */

import type { RobotMessage } from '../api/types';
import type { StopState } from './stop';

/** What is known of the arm: `free` means that nothing stops it, whether it moves or not. */
export type ArmNow = 'stopped' | 'free' | 'unknown';
export type Standing = 'holds' | 'unknown' | 'past';

/** s for which the arm must have been told to be as it is, where it was not told to be stopped first. */
export const SURE_AFTER = 1;

/** `isHeard`: whether the service is heard of now. */
export function armNow(isHeard: boolean, robot: Pick<RobotMessage, 'connection' | 'arm'> | null): ArmNow {
  if (!isHeard || robot?.connection !== 'connected' || robot.arm === 'disconnected') return 'unknown';
  return robot.arm === 'stopped' || robot.arm === 'fault' ? 'stopped' : 'free';
}

/** Follows the arm from the moment at which it was told what became of a stop. */
export class StopStanding {
  private standing: Standing = 'holds';
  private arm: ArmNow | null = null;
  private since = 0;
  private wasStopped = false;
  private wasUnknown = false;

  constructor(readonly kind: StopState['kind']) {}

  heard(arm: ArmNow, at: number): Standing {
    if (arm !== this.arm) this.since = at;
    this.arm = arm;
    if (this.standing === 'past') return 'past';
    this.standing = this.isPast(arm, at - this.since) ? 'past' : arm === 'unknown' ? 'unknown' : 'holds';
    this.wasStopped ||= arm === 'stopped';
    this.wasUnknown ||= arm === 'unknown';
    return this.standing;
  }

  /**
   * A stop that has not arrived stays urgent while the arm goes on unstopped before everybody's eyes: only what was
   * unknown meanwhile, or has been stopped after all, makes it past.
   */
  private isPast(arm: ArmNow, lasted: number): boolean {
    if (arm === 'unknown') return false;
    if (arm === 'free' && this.wasStopped) return true;
    if (lasted < SURE_AFTER) return false;
    if (this.kind === 'confirmed') return arm === 'free';
    if (this.kind === 'delivered') return arm === 'free' && this.wasUnknown;
    return this.kind === 'not delivered' && (arm === 'stopped' || this.wasUnknown);
  }
}
