/** A trace beside its simulation: the service simulates it with a model, in a job of its own, and the curve is laid over. */

import { api, ask, asProblem, here, type Problem } from '../../lib/api';
import { rmsDifference } from '../../lib/traces/columns';

/** s that one question waits for the job's end. */
const WAIT = 20;

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

export class Simulating {
  shown = $state.raw<Simulation | null>(null);
  busy = $state(false);
  progress = $state('');
  problem = $state.raw<Problem | null>(null);
  private turn = 0;

  constructor(private readonly trace: string) {}

  /** Simulates the trace with a model (`machine`: as the machine file describes it) and shows the curve. */
  async with(model: string): Promise<void> {
    const turn = ++this.turn;
    this.busy = true;
    this.problem = null;
    this.progress = 'waits for a worker';
    try {
      const body = { kind: 'compare' as const, traces: [this.trace], models: [model] };
      const job = await ask(api.POST('/api/v1/robots/{robot}/jobs', { params: { path: here() }, body }));
      const found = await this.ended(job.id, turn);
      if (turn === this.turn) this.shown = simulationOf(found, model);
      // What was only looked at is not kept: a job would keep the trace from being deleted.
      await ask(
        api.DELETE('/api/v1/robots/{robot}/jobs/{job}', { params: { path: { ...here(), job: job.id } } }),
      );
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
    const path = { ...here(), job: id };
    for (;;) {
      const query = { wait: WAIT };
      const job = await ask(api.GET('/api/v1/robots/{robot}/jobs/{job}', { params: { path, query } }));
      if (turn === this.turn) this.progress = job.progress_text;
      if (job.state === 'done') break;
      if (job.state !== 'queued' && job.state !== 'running') throw new Error(job.reason);
    }
    const result = await ask(api.GET('/api/v1/robots/{robot}/jobs/{job}/result', { params: { path } }));
    return result.data as unknown as Compared;
  }
}

function simulationOf(found: Compared, model: string): Simulation {
  const [signals] = found.signals;
  const position = signals?.simulated[0];
  if (signals === undefined || position === undefined) throw new Error('the comparison holds no signals');
  const rms = position.map((row, index) => rmsDifference(row, signals.measured[index] ?? []));
  return { model, joints: signals.joints, time: signals.time, position, rms };
}
