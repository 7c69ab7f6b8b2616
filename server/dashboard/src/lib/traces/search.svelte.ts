/** Traces to choose from, the newest first, with a search. What asks the service is handed in. */

import { asProblem, type Problem } from '../api/problem';
import type { CatalogueEntry } from '../api/types';

export class TraceSearch {
  query = $state('');
  /** Null before the first answer. */
  found = $state.raw<readonly CatalogueEntry[] | null>(null);
  problem = $state.raw<Problem | null>(null);

  /** `request`: the traces that match; all for an empty text. */
  constructor(private readonly request: (query: string) => Promise<readonly CatalogueEntry[]>) {}

  /** Asks for what is typed now. An answer to what was typed before is not shown any more. */
  async load(): Promise<void> {
    const asked = this.query.trim();
    const isNow = (): boolean => asked === this.query.trim();
    try {
      const found = await this.request(asked);
      if (isNow()) [this.found, this.problem] = [found, null];
    } catch (error) {
      if (isNow()) this.problem = asProblem(error);
    }
  }
}
