/** Gripper and process signals. Nobody tells of their changes: they are looked at. What asks is handed in. */

import { asProblem, type Problem } from '../api/problem';
import type { ProcessState } from '../api/types';

/** s after which signals that could not be looked at again are no longer shown as what is: three looks. */
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
  /** When the signals shown were asked for, s. */
  private askedAt = $state<number | null>(null);
  private turn = 0;
  private waiting = 0;

  /** `now` is this computer's clock, s. */
  constructor(
    private readonly requests: ProcessRequests,
    private readonly now: () => number,
  ) {}

  /** Asks for them, unless an answer is still awaited: it will tell. */
  async look(): Promise<void> {
    if (this.waiting === 0) await this.newest(() => this.requests.look());
  }

  /** How old the signals are at `now`, s; null where they are new enough to be what is, or not known at all. */
  oldAt(now: number): number | null {
    const age = this.askedAt === null ? 0 : now - this.askedAt;
    return age > OLD_AFTER ? age : null;
  }

  grip(closed: boolean): Promise<void> {
    return this.newest(() => this.requests.grip(closed));
  }

  set(output: number, on: boolean): Promise<void> {
    return this.newest(() => this.requests.set(output, on));
  }

  /** What was asked for earlier says nothing any more once something was asked for later. */
  private async newest(request: () => Promise<ProcessState>): Promise<void> {
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
