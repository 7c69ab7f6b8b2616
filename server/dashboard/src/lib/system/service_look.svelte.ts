/** The service as it was when it was last looked at: its health, its jobs, what happened. What asks is handed in. */

import { asProblem, type Problem } from '../api/problem';
import type { AuditEntry, Destination, Health, Job, ServiceEvent, SystemStatus } from '../api/types';

/** What is known of it at one moment. */
export interface Seen {
  readonly system: SystemStatus;
  readonly health: Health;
  /** Those that wait or run. */
  readonly jobs: readonly Job[];
  /** The newest first. */
  readonly events: readonly ServiceEvent[];
  /** The newest rows of the audit log, the newest first; null where there is nothing to show. */
  readonly audit: readonly AuditEntry[] | null;
  /** Who is told what, and how far that is. */
  /** Null where nobody can be told. */
  readonly destinations: readonly Destination[] | null;
}

export class ServiceLook {
  /** Null until it was seen; what was seen last stays while it cannot be asked. */
  seen = $state.raw<Seen | null>(null);
  problem = $state.raw<Problem | null>(null);

  constructor(private readonly request: () => Promise<Seen>) {}

  async look(): Promise<void> {
    try {
      this.seen = await this.request();
      this.problem = null;
    } catch (error) {
      this.problem = asProblem(error);
    }
  }
}

/** What happened, the newest first: what was told since, before what was asked for; each once. */
export function newestEvents(
  told: readonly ServiceEvent[],
  asked: readonly ServiceEvent[],
  most: number,
): readonly ServiceEvent[] {
  const known = new Set(asked.map((event) => event.number));
  return [...told.filter((event) => !known.has(event.number)), ...asked].slice(0, most);
}
