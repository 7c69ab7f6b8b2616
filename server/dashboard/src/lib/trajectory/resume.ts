/** Why the queue cannot be resumed now. */

import type { RobotMessage } from '../api/types';

/** Empty where it can. A stop or a fault is ended by a reset, which a person gives who has looked at the arm. */
export function resumeHindrance(arm: RobotMessage['arm'] | undefined): string {
  if (arm === 'stopped') return 'the arm is stopped: reset it first';
  if (arm === 'fault') return 'the arm has a fault: reset it first';
  return '';
}
