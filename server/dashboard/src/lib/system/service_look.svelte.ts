/** The service as it was when it was last looked at: its health, its jobs. What asks is handed in. */

import { asProblem, type Problem } from '../api/problem';
import type { AuditEntry, Destination, Health, Job, SystemStatus } from '../api/types';

/** What is known of it at one moment. */
export interface Seen {
  readonly system: SystemStatus;
  readonly health: Health;
  /** Those that wait or run. */
  readonly jobs: readonly Job[];
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
