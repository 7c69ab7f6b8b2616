/**
 * The run that failed last, until one succeeds or somebody has read it: a reset and a resumed queue look as if nothing had
 * been, while what held the arm up may still be there.
 */

import { api, ask, here, type Experiment } from '../api';
import { live } from '../live/live.svelte';
import { troubleOf } from './followed';

/** Runs that are looked at: those that were cancelled since say nothing. */
const LOOKED_AT = 10;
const KEY = 'ma2000-read-run';

export class LastTrouble {
  private found = $state.raw<Experiment | null>(null);
  private read = $state(localStorage.getItem(KEY));
  /** Null where there is none, or it was read. */
  run: Experiment | null = $derived(this.found?.id === this.read ? null : this.found);

  /** For an effect: asks again when a run has begun or ended, or the connection has come back. */
  follow(): void {
    void [live.queue?.running, live.healed];
    const query = { order: 'ended' as const, limit: LOOKED_AT };
    void ask(api.GET('/api/v1/robots/{robot}/experiments', { params: { path: here(), query } })).then(
      (ended) => (this.found = troubleOf(ended.items)),
      () => {}, // what was known stays; the connection is told elsewhere
    );
  }

  dismiss(): void {
    this.read = this.found?.id ?? null;
    if (this.read !== null) localStorage.setItem(KEY, this.read);
  }
}
