/** What stands at the right edge of a moving chart. Pure. */

import { timeOfDay } from '../format';

/**
 * "now" only while it is: else the time of day of the last sample that is drawn, whose `age` (s) is known at `wall` (ms
 * since 1970).
 */
export function edgeText(isNow: boolean, age: number | null, wall: number): string {
  if (isNow) return 'now';
  return age === null ? 'last sample' : timeOfDay(new Date(wall - age * 1000).toISOString());
}
