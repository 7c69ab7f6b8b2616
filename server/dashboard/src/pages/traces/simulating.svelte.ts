/**
 * A trace beside its simulation: the service simulates it with a model, in a job of its own, and the curve is laid over.
 * What asks the service is handed in.
 */

import { asProblem, type Problem } from '../../lib/api/problem';
import type { Job } from '../../lib/api/types';
import { rmsDifference } from '../../lib/traces/columns';

/** Columns of the joints that the model describes; rad, or m on a prismatic joint. */
export interface Simulation {
  readonly model: string;
  readonly joints: readonly number[];
  readonly time: readonly number[];
  readonly position: readonly (readonly number[])[];
  /** Root mean square of simulated − measured, one a joint. */
  readonly rms: readonly number[];
}

interface Compared {
  readonly signals: readonly {
    readonly joints: readonly number[];
    readonly time: readonly number[];
    readonly measured: readonly (readonly number[])[];
    readonly simulated: readonly (readonly (readonly number[])[])[];
  }[];
}

export interface SimulatingRequests {
  /** The number of a new job. */
  begin(trace: string, model: string): Promise<string>;
  /** The job once it has ended, or after a while. */
  news(job: string): Promise<Job>;
  result(job: string): Promise<unknown>;
  remove(job: string): Promise<void>;
}

export class Simulating {
  shown = $state.raw<Simulation | null>(null);
  busy = $state(false);
  progress = $state('');
  problem = $state.raw<Problem | null>(null);
  private turn = 0;

  constructor(
    private readonly trace: string,
    private readonly requests: SimulatingRequests,
  ) {}

  /** Simulates the trace with a model (`machine`: as the machine file describes it) and shows the curve. */
  async with(model: string): Promise<void> {
    const turn = ++this.turn;
    this.busy = true;
    this.problem = null;
    this.progress = 'waiting for a worker';
    try {
      const job = await this.requests.begin(this.trace, model);
      try {
        const found = await this.ended(job, turn);
        if (turn === this.turn) this.shown = simulationOf(found, model);
      } finally {
        // What was only looked at is not kept, nor what failed: a job would keep the trace from being deleted.
        await this.requests.remove(job).catch(() => {});
      }
    } catch (error) {
      if (turn === this.turn) this.problem = asProblem(error);
    } finally {
      if (turn === this.turn) this.busy = false;
    }
  }

  forget(): void {
    this.turn += 1;
    this.shown = null;
    this.busy = false;
    this.problem = null;
  }

  private async ended(id: string, turn: number): Promise<Compared> {
    for (;;) {
      const job = await this.requests.news(id);
      if (turn === this.turn) this.progress = job.progress_text;
      if (job.state === 'done') break;
      if (job.state !== 'queued' && job.state !== 'running') throw new Error(job.reason);
    }
    return (await this.requests.result(id)) as Compared;
  }
}

function simulationOf(found: Compared, model: string): Simulation {
  const [signals] = found.signals;
  const position = signals?.simulated[0];
  if (signals === undefined || position === undefined) throw new Error('the comparison holds no signals');
  const rms = position.map((row, index) => rmsDifference(row, signals.measured[index] ?? []));
  return { model, joints: signals.joints, time: signals.time, position, rms };
}
