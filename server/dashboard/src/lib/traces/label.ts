/** What a trace is called where it is chosen: people know it by its name and its time, not by its number. */

import { dayAndSecond } from '../format';

export interface Named {
  readonly id: string;
  readonly name: string | null;
  readonly kind: string | null;
  readonly created: string;
}

/** Its name, else its kind. */
export function traceName(entry: Named): string {
  return entry.name ?? entry.kind?.replaceAll('_', ' ') ?? entry.id;
}

/** `ramp, 21 Nov 2026, 10:22:05`: to the second, for a short motion is repeated within a minute. */
export function traceLabel(entry: Named): string {
  return `${traceName(entry)}, ${dayAndSecond(entry.created)}`;
}
