/** The same experiment for several arms: each gets it in its own queue, all or none. */

import { api, ask, here } from '../api/client';
import { asProblem, type Problem } from '../api/problem';
import type { ExperimentPreset } from '../api/types';

export class SameExperiment {
  presets = $state.raw<readonly ExperimentPreset[]>([]);
  preset = $state('');
  /** Arms that are left out. */
  left = $state.raw<ReadonlySet<string>>(new Set());
  busy = $state(false);
  problem = $state.raw<Problem | null>(null);
  done = $state('');

  /** The presets of the arm that the page shows: an arm that cannot run one says so, and then none gets it. */
  async load(): Promise<void> {
    try {
      this.presets = await ask(api.GET('/api/v1/robots/{robot}/presets', { params: { path: here() } }));
      this.preset ||= this.presets[0]?.name ?? '';
    } catch (error) {
      this.problem = asProblem(error);
    }
  }

  toggle(name: string): void {
    const left = new Set(this.left);
    if (!left.delete(name)) left.add(name);
    this.left = left;
  }

  async send(names: readonly string[], key: string): Promise<void> {
    const spec = this.presets.find((one) => one.name === this.preset)?.spec;
    if (spec === undefined || this.busy) return;
    this.busy = true;
    this.problem = null;
    this.done = '';
    try {
      const body = { request: { spec, priority: 0 }, robots: [...names] };
      const params = { header: { 'idempotency-key': key } };
      const made = (await ask(api.POST('/api/v1/fleet/experiments', { params, body } as never))) as {
        experiments: readonly { robot: string }[];
      };
      this.done = `${this.preset} is in the queue of ${made.experiments.map((one) => one.robot).join(', ')}`;
    } catch (error) {
      this.problem = asProblem(error);
    } finally {
      this.busy = false;
    }
  }
}
