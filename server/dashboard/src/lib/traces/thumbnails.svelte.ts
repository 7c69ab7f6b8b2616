/** Thumbnails of traces: asked for when they come into sight, one after the other, and kept, since a trace never changes. */

import { SvelteMap } from 'svelte/reactivity';
import { api, ask, here, type CatalogueEntry } from '../api';
import { thumbnailOf, type Thumbnail } from './thumbnail';

/** Of a signal: a thumbnail has no more room. */
const POINTS = 60;

class Thumbnails {
  private readonly known = new SvelteMap<string, Thumbnail | null>();
  private turn: Promise<void> = Promise.resolve();

  /** Undefined before it is known, null where there is none. */
  of(id: string): Thumbnail | null | undefined {
    return this.known.get(id);
  }

  /** Asks for one when its place comes into sight: an attachment. */
  readonly seen =
    (entry: CatalogueEntry) =>
    (place: Element): (() => void) => {
      const observer = new IntersectionObserver((entries) => {
        if (!entries.some((one) => one.isIntersecting)) return;
        observer.disconnect();
        if (!this.known.has(entry.id)) this.turn = this.turn.then(() => this.ask(entry));
      });
      observer.observe(place);
      return () => observer.disconnect();
    };

  private async ask({ id, moved }: CatalogueEntry): Promise<void> {
    if (this.known.has(id)) return;
    try {
      const params = { path: { ...here(), trace: id }, query: { points: POINTS } };
      const signals = await ask(api.GET('/api/v1/robots/{robot}/traces/{trace}/data.json', { params }));
      this.known.set(id, thumbnailOf(signals, moved ?? []));
    } catch {
      this.known.set(id, null); // the list says what is wrong with a trace that cannot be read
    }
  }
}

export const thumbnails = new Thumbnails();
