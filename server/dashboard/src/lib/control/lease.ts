/**
 * Keeps the control alive by heartbeats until it is given back, or refused. Knows nothing about a browser: what asks the
 * service, and what tells the time, is handed in.
 */

import { asProblem, NOT_ANSWERED, type Problem } from '../api/problem';
import type { ControlLease } from '../api/types';

/** Share of the time between heartbeats that the service asks for: a busy browser is late. */
const EARLY = 0.6;
/** s until the next try where nobody has answered: the service may be back before the lease lapses. */
export const AGAIN_AFTER = 1;

export interface LeaseParts {
  renew(lease: string): Promise<ControlLease>;
  after(seconds: number, call: () => void): () => void;
  /** The lease that is held from now on; null: none. */
  told(lease: ControlLease | null): void;
  /** The service has refused to renew it. */
  lost(problem: Problem): void;
}

export class LeaseKeeper {
  private held: ControlLease | null = null;
  private cancel: () => void = () => {};

  constructor(private readonly parts: LeaseParts) {}

  /** Holds this lease, and renews it from now on. */
  keep(lease: ControlLease): void {
    this.hold(lease);
    this.cancel = this.parts.after(EARLY * lease.heartbeat_every, () => void this.renew());
  }

  /** Renews no more. An answer to what is still on its way is not taken for the control. */
  forget(): void {
    this.hold(null);
  }

  private hold(lease: ControlLease | null): void {
    this.cancel();
    this.held = lease;
    this.parts.told(lease);
  }

  private async renew(): Promise<void> {
    const asked = this.held;
    if (asked === null) return;
    try {
      const renewed = await this.parts.renew(asked.lease);
      if (this.held === asked) this.keep(renewed);
    } catch (error) {
      if (this.held !== asked) return;
      const problem = asProblem(error);
      if (problem.kind === NOT_ANSWERED) {
        this.cancel = this.parts.after(AGAIN_AFTER, () => void this.renew());
        return;
      }
      this.forget();
      this.parts.lost(problem);
    }
  }
}
