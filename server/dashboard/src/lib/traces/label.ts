/** What a trace is called where it is chosen: people know it by its name and its time, not by its number. */

import { dayAndTime } from '../format';

export interface Named {
  readonly name: string | null;
  readonly kind: string | null;
  readonly created: string;
}

/** `ramp, 21 Nov 2026, 10:22`; its number where nothing is known of it. */
export function traceLabel(id: string, entry: Named | undefined): string {
  if (entry === undefined) return id;
  return `${entry.name ?? entry.kind?.replaceAll('_', ' ') ?? id}, ${dayAndTime(entry.created)}`;
}
