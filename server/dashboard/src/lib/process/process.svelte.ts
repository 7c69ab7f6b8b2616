/** Gripper and process signals. Nobody tells of their changes: they are looked at. What asks is handed in. */

import { asProblem, type Problem } from '../api/problem';
import type { ProcessState } from '../api/types';

export interface ProcessRequests {
  look(): Promise<ProcessState>;
  grip(closed: boolean): Promise<ProcessState>;
  set(output: number, on: boolean): Promise<ProcessState>;
}

export class ProcessSignals {
  /** Null until they are known. */
  signals = $state.raw<ProcessState | null>(null);
  problem = $state.raw<Problem | null>(null);
  private turn = 0;

  constructor(private readonly requests: ProcessRequests) {}

  look(): Promise<void> {
    return this.newest(() => this.requests.look());
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
    try {
      const signals = await request();
      if (turn === this.turn) [this.signals, this.problem] = [signals, null];
    } catch (error) {
      if (turn === this.turn) this.problem = asProblem(error);
    }
  }
}
