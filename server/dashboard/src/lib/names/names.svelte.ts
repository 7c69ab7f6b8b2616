/** Names of things that are known by their numbers alone: asked for once each, and shown when they are known. */

import { SvelteMap } from 'svelte/reactivity';

export class Names {
  private known = new SvelteMap<string, string>();
  private asked = new Set<string>();

  /** `request`: the name of one of them. */
  constructor(private readonly request: (id: string) => Promise<string>) {}

  /** Its number until its name is known; that of one that is gone stays its number. */
  of(id: string): string {
    return this.known.get(id) ?? id;
  }

  /** Takes names that came with what is shown: nobody is asked for them. */
  take(ids: readonly string[], names: Readonly<Record<string, string>>): void {
    for (const id of ids) {
      this.asked.add(id);
      this.known.set(id, names[id] ?? id);
    }
  }

  /** Asks for those that are not known: for an effect. */
  learn(ids: readonly string[]): void {
    for (const id of ids) {
      if (this.asked.has(id)) continue;
      this.asked.add(id);
      void this.ask(id);
    }
  }

  private async ask(id: string): Promise<void> {
    try {
      this.known.set(id, await this.request(id));
    } catch {
      this.asked.delete(id);
    }
  }
}
