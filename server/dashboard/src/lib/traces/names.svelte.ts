/** Names of traces that are known by their numbers alone: asked for once each, and shown when they are known. */

import { SvelteMap } from 'svelte/reactivity';
import { api, ask, here } from '../api';
import { traceLabel, type Named } from './label';

class TraceNames {
  private known = new SvelteMap<string, Named>();
  private asked = new Set<string>();

  of(id: string): string {
    return traceLabel(id, this.known.get(id));
  }

  /** Asks for those that are not known: for an effect. A trace that is gone keeps its number. */
  learn(ids: readonly string[]): void {
    for (const id of ids) {
      if (this.asked.has(id)) continue;
      this.asked.add(id);
      void this.ask(id);
    }
  }

  private async ask(id: string): Promise<void> {
    try {
      const params = { path: { ...here(), trace: id } };
      const { entry } = await ask(api.GET('/api/v1/robots/{robot}/traces/{trace}', { params }));
      this.known.set(id, entry);
    } catch {
      this.asked.delete(id);
    }
  }
}

export const traceNames = new TraceNames();
