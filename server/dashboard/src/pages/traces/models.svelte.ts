/** The models with which a trace can be simulated: the machine file's own, and those that were fitted. */

import { api, ask, asProblem, here, type ModelEntry, type Problem } from '../../lib/api';

/** The number of the model that the machine file describes. */
export const MACHINE = 'machine';

export class Models {
  items = $state.raw<readonly ModelEntry[]>([]);
  problem = $state.raw<Problem | null>(null);
  private asked = false;

  /** Asks for the list, once. */
  async load(): Promise<void> {
    if (this.asked) return;
    this.asked = true;
    try {
      const params = { path: here(), query: { limit: 100 } };
      this.items = (await ask(api.GET('/api/v1/robots/{robot}/models', { params }))).items;
    } catch (error) {
      this.asked = false;
      this.problem = asProblem(error);
    }
  }

  nameOf(id: string): string {
    return id === MACHINE ? 'the machine file' : (this.items.find((model) => model.id === id)?.name ?? id);
  }
}
