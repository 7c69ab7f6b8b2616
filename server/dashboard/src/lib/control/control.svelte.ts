/**
 * The control of the robot: taken, renewed by heartbeats, given back, also when the tab is closed. Its secret never
 * leaves this tab.
 */

import { api, ask, here } from '../api/client';
import { asProblem, type Problem } from '../api/problem';
import type { ControlLease } from '../api/types';

/** Share of the time between heartbeats that the service asks for: a busy browser is late. */
const EARLY = 0.6;

class ControlHeld {
  /** The lease, while this tab has the control. */
  lease = $state.raw<ControlLease | null>(null);
  problem = $state.raw<Problem | null>(null);
  /** Whether the operator's word for a real arm is what is missing. */
  needsConsent: boolean = $derived(this.problem?.kind === 'consent-needed');
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor() {
    addEventListener('pagehide', () => this.leave());
  }

  /** The header that goes with every motion. */
  header(): { 'Control-Lease'?: string } {
    return this.lease === null ? {} : { 'Control-Lease': this.lease.lease };
  }

  /** Asks for the control. `movesRealArm`: the operator's word that the workspace is clear. */
  async take(movesRealArm = false): Promise<void> {
    this.problem = null;
    try {
      const body = { moves_real_arm: movesRealArm };
      this.keep(await ask(api.POST('/api/v1/robots/{robot}/control', { params: { path: here() }, body })));
    } catch (error) {
      this.problem = asProblem(error);
    }
  }

  async giveBack(): Promise<void> {
    const header = this.header();
    this.forget();
    try {
      await ask(api.DELETE('/api/v1/robots/{robot}/control', { params: { path: here(), header } }));
    } catch (error) {
      this.problem = asProblem(error);
    }
  }

  private keep(lease: ControlLease): void {
    this.lease = lease;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => void this.renew(), EARLY * lease.heartbeat_every * 1000);
  }

  private async renew(): Promise<void> {
    if (this.lease === null) return;
    const params = { path: here(), header: this.header() };
    try {
      this.keep(await ask(api.PUT('/api/v1/robots/{robot}/control', { params })));
    } catch (error) {
      const problem = asProblem(error);
      if (problem.status === 0) {
        // The service may be back before the lease lapses.
        this.timer = setTimeout(() => void this.renew(), 1000);
        return;
      }
      this.forget();
      this.problem = problem;
    }
  }

  /** The tab goes: nobody is left who could renew it. */
  private leave(): void {
    if (this.lease === null) return;
    const params = { path: here(), header: this.header() };
    void api.DELETE('/api/v1/robots/{robot}/control', { params, keepalive: true }).catch(() => {});
  }

  private forget(): void {
    clearTimeout(this.timer);
    this.lease = null;
  }
}

export const control = new ControlHeld();
