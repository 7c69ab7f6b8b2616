/** Order of the queue. The service runs the highest priority first, and among equals the one submitted first. */

export interface Queued {
  readonly id: string;
  readonly priority: number;
  /** ISO 8601: later ones come after earlier ones of the same priority. */
  readonly submitted: string;
}

export interface PriorityChange {
  readonly id: string;
  readonly priority: number;
}

export const HIGHEST = 100;

/**
 * New priorities that bring what is at place `from` of the queue to place `to`, and leave the order of the
 * others; null when that would need a priority above the highest there is.
 */
export function reordered(queue: readonly Queued[], from: number, to: number): PriorityChange[] | null {
  const wanted = [...queue];
  const [moved] = wanted.splice(from, 1);
  if (moved === undefined || to < 0 || to > wanted.length) return [];
  wanted.splice(to, 0, moved);
  const priorities = wanted.map((one) => one.priority);
  if (to > from) priorities[to] = Math.min(moved.priority, wanted[to - 1]!.priority);
  for (let place = wanted.length - 2; place >= 0; place--) {
    const inverted = isLater(wanted[place]!, wanted[place + 1]!);
    const needed = priorities[place + 1]! + (inverted ? 1 : 0);
    priorities[place] = Math.max(priorities[place]!, needed);
  }
  if (priorities.some((priority) => priority > HIGHEST)) return null;
  return wanted
    .map((one, place) => ({ id: one.id, priority: priorities[place]!, before: one.priority }))
    .filter((one) => one.priority !== one.before)
    .map(({ id, priority }) => ({ id, priority }));
}

function isLater(one: Queued, other: Queued): boolean {
  return Date.parse(one.submitted) === Date.parse(other.submitted)
    ? one.submitted > other.submitted
    : Date.parse(one.submitted) > Date.parse(other.submitted);
}
