/** The list of traces: those that a query line asks for, a part at a time, and followed as new ones are recorded. */

import { untrack } from 'svelte';
import { api, ask, asProblem, here, type CatalogueEntry, type Problem } from '../../lib/api';
import { live } from '../../lib/live/live.svelte';
import { afterSeconds, Reload } from '../../lib/reload/reload';
import { Listing } from '../../lib/traces/listing';
import { searchOf, type Known } from '../../lib/traces/query';

/** s without a key before it is searched. */
const QUIET = 0.2;

export class Catalogue {
  /** The query line. */
  line = $state('');
  items = $state.raw<readonly CatalogueEntry[]>([]);
  problem = $state.raw<Problem | null>(null);
  loaded = $state(false);
  busy = $state(false);
  next = $state<string | null>(null);
  private effects = $state.raw<readonly string[] | null>(null);
  asked = $derived(searchOf(this.line, live.machine?.joints.length, this.effects ?? []));
  isFiltered: boolean = $derived(this.line.trim() !== '');
  /** What can be completed: of what is listed, or was. */
  known: Known = $derived.by(() => {
    for (const { tags, kind } of this.items) {
      for (const tag of tags) this.tags.add(tag);
      if (kind) this.kinds.add(kind);
    }
    const joints = live.machine?.joints.map((_, place) => place + 1) ?? [];
    return {
      tags: [...this.tags].sort(),
      kinds: [...this.kinds].sort(),
      joints,
      effects: this.effects ?? [],
    };
  });
  private readonly tags = new Set<string>();
  private readonly kinds = new Set<string>();
  private readonly listing = new Listing<CatalogueEntry>();
  private readonly reload = new Reload({ load: () => void this.load(), after: afterSeconds });
  private turn = 0;
  private shown = 0;

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
    if (this.line.includes('effect:')) void untrack(() => this.learnEffects());
    this.problem = null; // it was of another line
    this.listing.beginAnew();
    this.shown = this.turn + 1; // what was asked for before is not of this line
    this.reload.soon(untrack(() => this.loaded) ? QUIET : 0);
    return () => this.reload.leave();
  }

  async more(): Promise<void> {
    this.listing.more(this.items.length);
    await this.load();
  }

  /** The effects that can be completed: asked for once somebody wants one. */
  private async learnEffects(): Promise<void> {
    if (this.effects !== null) return;
    this.effects = [];
    try {
      const known = await ask(api.GET('/api/v1/robots/{robot}/effects', { params: { path: here() } }));
      this.effects = known.map((one) => one.name).sort();
    } catch {
      this.effects = null; // asked again at the next key
    }
  }

  /** Loads it anew, as far as it is shown. */
  async load(): Promise<void> {
    const turn = ++this.turn;
    this.busy = this.asked.problem === '';
    if (!this.busy) return; // the list waits for a line that can be searched
    const { search } = this.asked;
    try {
      const page = await this.listing.load((limit, cursor) => {
        const query = { limit, ...search, ...(cursor === null ? {} : { cursor }) };
        return ask(api.GET('/api/v1/robots/{robot}/traces', { params: { path: here(), query } }));
      });
      if (turn < this.shown) return;
      this.shown = turn; // newer ones may still be asked for: a busy service would else never be shown
      this.items = page.items;
      this.next = page.next;
      this.problem = null;
    } catch (error) {
      if (turn < this.shown) return;
      this.problem = asProblem(error);
    }
    this.loaded = true;
    this.busy = false;
  }
}
