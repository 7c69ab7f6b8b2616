/** Attendance of this page: whoever uses it is there. */

import { api, ask, here } from '../api/client';
import { live } from '../live/live.svelte';
import { Attendance } from './attendance';

/** Follows pointer and keys for as long as the page lives. */
export function startAttending(): void {
  const attendance = new Attendance({
    isNeeded: () => live.isOperator && live.needsAttendance,
    say: () => {
      // Where it does not arrive, the queue goes on counting down before everybody's eyes.
      ask(api.POST('/api/v1/robots/{robot}/queue/attend', { params: { path: here() } })).catch(() => {});
    },
    now: () => performance.now() / 1000,
  });
  const used = (): void => attendance.used();
  addEventListener('pointerdown', used, { capture: true });
  addEventListener('wheel', used, { capture: true, passive: true });
  // A key that repeats may have something lying on it.
  addEventListener('keydown', (event) => event.repeat || used(), { capture: true });
  addEventListener('pointermove', (event) => attendance.pointed(event.screenX, event.screenY), {
    capture: true,
  });
}
