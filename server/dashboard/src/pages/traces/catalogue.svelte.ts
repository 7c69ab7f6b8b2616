/** The list of traces: searched, filtered, a part at a time, and followed as new ones are recorded. */

import { untrack } from 'svelte';
import { api, ask, asProblem, here, type CatalogueEntry, type Problem } from '../../lib/api';
import { live } from '../../lib/live/live.svelte';
import { afterSeconds, Reload } from '../../lib/reload/reload';
import { Listing } from '../../lib/traces/listing';

/** s without a key before it is searched. */
const QUIET = 0.2;

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
  private readonly listing = new Listing<CatalogueEntry>();
  private readonly reload = new Reload({ load: () => void this.load(), after: afterSeconds });
  private asked = 0;

  /** Follows the service: a new trace appears by itself. */
  follow(): () => void {
    return live.onMessage((message) => {
      if (message.topic === 'event') this.reload.soon(QUIET);
    });
  }

  /** For an effect that follows how often the connection has come back. */
  afterHealing(times: number): void {
    this.reload.afterHealing(times);
  }

  /** For an effect that follows the fields of the search. */
  searchSoon(): () => void {
    void [this.text, this.tag, this.source, this.outcome];
    this.listing.beginAnew();
    this.reload.soon(untrack(() => this.loaded) ? QUIET : 0);
    return () => this.reload.leave();
  }

  clear(): void {
    this.text = this.tag = this.source = this.outcome = '';
  }

  async more(): Promise<void> {
    this.listing.more(this.items.length);
    await this.load();
  }

  /** Loads it anew, as far as it is shown. */
  async load(): Promise<void> {
    const turn = ++this.asked;
    this.busy = true;
    const search = {
      ...(this.text === '' ? {} : { q: this.text }),
      ...(this.tag === '' ? {} : { tag: this.tag }),
      ...(this.source === '' ? {} : { source: this.source }),
      ...(this.outcome === '' ? {} : { outcome: this.outcome }),
    };
    try {
      const page = await this.listing.load((limit, cursor) => {
        const query = { limit, ...search, ...(cursor === null ? {} : { cursor }) };
        return ask(api.GET('/api/v1/robots/{robot}/traces', { params: { path: here(), query } }));
      });
      if (turn !== this.asked) return;
      this.items = page.items;
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
