/**
 * Whether what became of a stop still holds: no message may outlive what it says. Pure; times in s, of any clock that
 * only goes forward.
 */

import type { RobotMessage } from '../api/types';
import type { StopState } from './stop';

/** What is known of the arm: `free`: nothing stops it, whether it moves or not; `unheard`: nor is the service heard of. */
export type ArmNow = 'stopped' | 'free' | 'unknown' | 'unheard';
/** `answered`: the service, which was not heard of, is again; what it did not take is urgent until the arm is known. */
export type Standing = 'holds' | 'unknown' | 'answered' | 'past';

/** s for which the arm must have been told to be as it is, where it was not told to be stopped first. */
export const SURE_AFTER = 1;

/** `isHeard`: whether the service is heard of now. */
export function armNow(isHeard: boolean, robot: Pick<RobotMessage, 'connection' | 'arm'> | null): ArmNow {
  if (!isHeard) return 'unheard';
  if (robot?.connection !== 'connected' || robot.arm === 'disconnected') return 'unknown';
  return robot.arm === 'stopped' || robot.arm === 'fault' ? 'stopped' : 'free';
}

/**
 * Whether a reset says nothing of the arm any more: its connection is gone, or it was stopped again. `before`: what was
 * told last, which may still be the stop that the reset has ended.
 */
export function isResetOver(
  before: Pick<RobotMessage, 'connection' | 'arm'> | null,
  now: Pick<RobotMessage, 'connection' | 'arm'>,
): boolean {
  const arm = armNow(true, now);
  return arm === 'unknown' || (arm === 'stopped' && armNow(true, before) !== 'stopped');
}

/** Follows the arm from the moment at which it was told what became of a stop. */
export class StopStanding {
  private standing: Standing = 'holds';
  private arm: ArmNow | null = null;
  private since = 0;
  private wasStopped = false;
  private wasUnknown = false;
  private wasUnheard = false;

  constructor(readonly kind: StopState['kind']) {}

  heard(arm: ArmNow, at: number): Standing {
    if (arm !== this.arm) this.since = at;
    this.arm = arm;
    if (this.standing === 'past') return 'past';
    this.standing = this.isPast(arm, at - this.since) ? 'past' : this.standingWith(arm);
    this.wasStopped ||= arm === 'stopped';
    this.wasUnknown ||= arm === 'unknown' || arm === 'unheard';
    this.wasUnheard ||= arm === 'unheard';
    return this.standing;
  }

  private standingWith(arm: ArmNow): Standing {
    if (this.kind === 'not delivered' && this.wasUnheard && arm !== 'unheard') return 'answered';
    return arm === 'unknown' || arm === 'unheard' ? 'unknown' : 'holds';
  }

  /**
   * A stop that has not arrived stays urgent while the arm goes on unstopped before everybody's eyes: only what was
   * unknown meanwhile, or has been stopped after all, makes it past.
   */
  private isPast(arm: ArmNow, lasted: number): boolean {
    if (arm === 'unknown' || arm === 'unheard') return false;
    if (arm === 'free' && this.wasStopped) return true;
    if (lasted < SURE_AFTER) return false;
    if (this.kind === 'confirmed') return arm === 'free';
    if (this.kind === 'delivered') return arm === 'free' && this.wasUnknown;
    return this.kind === 'not delivered' && (arm === 'stopped' || this.wasUnknown);
  }
}
