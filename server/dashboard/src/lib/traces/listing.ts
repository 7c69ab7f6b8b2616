/**
 * A list that is shown a part at a time. Whenever it is loaded again it is loaded as far as it was, so that nothing that
 * somebody has asked to see goes away.
 */

export interface Page<Entry> {
  readonly items: readonly Entry[];
  /** Where the next part begins; null at the end. */
  readonly next: string | null;
}

/** Entries of one part. */
export const PART = 40;
/** Entries that the service gives at once. */
export const AT_ONCE = 200;

export class Listing<Entry> {
  private wanted = PART;

  /** One part more than `shown` entries is wanted from now on. */
  more(shown: number): void {
    this.wanted = shown + PART;
  }

  /** From the beginning: another list. */
  beginAnew(): void {
    this.wanted = PART;
  }

  /** The list as far as it is wanted. `ask` gives up to `limit` entries from a cursor on, and may throw. */
  async load(ask: (limit: number, cursor: string | null) => Promise<Page<Entry>>): Promise<Page<Entry>> {
    const { wanted } = this;
    const items: Entry[] = [];
    let next: string | null = null;
    do {
      const page: Page<Entry> = await ask(Math.min(AT_ONCE, wanted - items.length), next);
      items.push(...page.items);
      next = page.next;
    } while (next !== null && items.length < wanted);
    return { items, next };
  }
}
