/** Gripper and process signals. The service does not push their changes, so this class polls. */

import { asProblem, type Problem } from '../api/problem';
import type { ProcessState } from '../api/types';

/** Age (s) from which signals count as out of date: three polls. */
export const OLD_AFTER = 3;

export interface ProcessRequests {
  look(): Promise<ProcessState>;
  grip(closed: boolean): Promise<ProcessState>;
  set(output: number, on: boolean): Promise<ProcessState>;
}

export class ProcessSignals {
  /** Null until they are known. */
  signals = $state.raw<ProcessState | null>(null);
  problem = $state.raw<Problem | null>(null);
  /** Time of the request that gave the signals shown, s. */
  private askedAt = $state<number | null>(null);
  private turn = 0;
  private waiting = 0;

  /** `now` is this computer's clock, s. */
  constructor(
    private readonly requests: ProcessRequests,
    private readonly now: () => number,
  ) {}

  /** Requests them, unless an answer is still awaited. */
  async look(): Promise<void> {
    if (this.waiting === 0) await this.sendLatest(() => this.requests.look());
  }

  /** Age (s) of the signals at `now`; null if they are current, or not known. */
  oldAt(now: number): number | null {
    const age = this.askedAt === null ? 0 : now - this.askedAt;
    return age > OLD_AFTER ? age : null;
  }

  grip(closed: boolean): Promise<void> {
    return this.sendLatest(() => this.requests.grip(closed));
  }

  set(output: number, on: boolean): Promise<void> {
    return this.sendLatest(() => this.requests.set(output, on));
  }

  /** Sends a request. Its answer is ignored if a newer request was sent meanwhile. */
  private async sendLatest(request: () => Promise<ProcessState>): Promise<void> {
    const turn = ++this.turn;
    const at = this.now();
    this.waiting += 1;
    try {
      const signals = await request();
      if (turn === this.turn) [this.signals, this.problem, this.askedAt] = [signals, null, at];
    } catch (error) {
      if (turn === this.turn) this.problem = asProblem(error);
    } finally {
      this.waiting -= 1;
    }
  }
}
