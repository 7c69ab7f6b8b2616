/**
 * The control of the robot: taken, renewed by heartbeats, given back, also when the tab is closed. Its secret never
 * leaves this tab.
 */

import { api, ask, here } from '../api/client';
import { asProblem, type Problem } from '../api/problem';
import type { ControlLease } from '../api/types';
import { LeaseKeeper } from './lease';

class ControlHeld {
  /** The lease, while this tab has the control. */
  lease = $state.raw<ControlLease | null>(null);
  problem = $state.raw<Problem | null>(null);
  /** Whether the operator's word for a real arm is what is missing. */
  needsConsent: boolean = $derived(this.problem?.kind === 'consent-needed');
  private readonly keeper = new LeaseKeeper({
    renew: (lease) => {
      const params = { path: here(), header: { 'Control-Lease': lease } };
      return ask(api.PUT('/api/v1/robots/{robot}/control', { params }));
    },
    after: (seconds, call) => {
      const timer = setTimeout(call, seconds * 1000);
      return () => clearTimeout(timer);
    },
    told: (lease) => {
      this.lease = lease;
    },
    lost: (problem) => {
      this.problem = problem;
    },
  });

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
      const params = { path: here() };
      this.keeper.keep(await ask(api.POST('/api/v1/robots/{robot}/control', { params, body })));
    } catch (error) {
      this.problem = asProblem(error);
    }
  }

  async giveBack(): Promise<void> {
    const header = this.header();
    this.keeper.forget();
    try {
      await ask(api.DELETE('/api/v1/robots/{robot}/control', { params: { path: here(), header } }));
    } catch (error) {
      this.problem = asProblem(error);
    }
  }

  /** The tab goes: nobody is left who could renew it. */
  private leave(): void {
    if (this.lease === null) return;
    const params = { path: here(), header: this.header() };
    void api.DELETE('/api/v1/robots/{robot}/control', { params, keepalive: true }).catch(() => {});
  }
}

export const control = new ControlHeld();
