/** The list of traces: searched, filtered, a part at a time, and followed as new ones are recorded. */

import { api, ask, asProblem, here, type CatalogueEntry, type Problem } from '../../lib/api';
import { live } from '../../lib/live/live.svelte';

/** ms without a key before it is searched. */
const QUIET = 200;
const PART = 40;

export type Source = 'mock' | 'real' | 'imported';
export type Outcome = 'complete' | 'stopped' | 'fault' | 'interrupted';

export class Catalogue {
  text = $state('');
  tag = $state('');
  source = $state<Source | ''>('');
  outcome = $state<Outcome | ''>('');
  items = $state.raw<readonly CatalogueEntry[]>([]);
  problem = $state.raw<Problem | null>(null);
  loaded = $state(false);
  busy = $state(false);
  next = $state<string | null>(null);
  isFiltered: boolean = $derived(
    this.text !== '' || this.tag !== '' || this.source !== '' || this.outcome !== '',
  );
  private asked = 0;
  private timer: ReturnType<typeof setTimeout> | undefined;

  /** Follows the service: a new trace appears by itself. */
  follow(): () => void {
    return live.onMessage((message) => {
      if (message.topic === 'event') this.loadSoon();
    });
  }

  /** For an effect that follows the fields of the search. */
  searchSoon(): () => void {
    void [this.text, this.tag, this.source, this.outcome];
    this.loadSoon();
    return () => clearTimeout(this.timer);
  }

  clear(): void {
    this.text = this.tag = this.source = this.outcome = '';
  }

  async load(): Promise<void> {
    await this.ask(null);
  }

  async more(): Promise<void> {
    if (this.next !== null) await this.ask(this.next);
  }

  private loadSoon(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => void this.load(), this.loaded ? QUIET : 0);
  }

  private async ask(cursor: string | null): Promise<void> {
    const turn = ++this.asked;
    this.busy = true;
    const query = {
      limit: PART,
      ...(this.text === '' ? {} : { q: this.text }),
      ...(this.tag === '' ? {} : { tag: this.tag }),
      ...(this.source === '' ? {} : { source: this.source }),
      ...(this.outcome === '' ? {} : { outcome: this.outcome }),
      ...(cursor === null ? {} : { cursor }),
    };
    try {
      const page = await ask(api.GET('/api/v1/robots/{robot}/traces', { params: { path: here(), query } }));
      if (turn !== this.asked) return;
      this.items = cursor === null ? page.items : [...this.items, ...page.items];
      this.next = page.next;
      this.problem = null;
    } catch (error) {
      if (turn !== this.asked) return;
      this.problem = asProblem(error);
    }
    this.loaded = true;
    this.busy = false;
  }
}
