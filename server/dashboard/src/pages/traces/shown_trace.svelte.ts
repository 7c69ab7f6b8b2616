/** One trace that is shown: its signals, finer where it is zoomed to, what it says about itself, and its simulation. */

import { api, ask, asProblem, here, type Problem, type TraceDetails, type TraceSignals } from '../../lib/api';
import { dayAndSecond } from '../../lib/format';
import { traceName } from '../../lib/traces/label';
import { counted, isThinned, motionBegin, refined, type Range, type Signals } from '../../lib/traces/columns';
import { serves, toAsk } from '../../lib/traces/zoom';
import { Simulating } from './simulating.svelte';
import { SIMULATING_REQUESTS } from './simulating_requests';

/** Points of a plot. */
const POINTS = 3000;
/** Points between two cursors: measures are taken of every sample. */
export const EXACT = 20_000;

export class ShownTrace {
  details = $state.raw<TraceDetails | null>(null);
  problem = $state.raw<Problem | null>(null);
  readonly simulating: Simulating;
  /** As it was recorded, thinned to what a picture shows. */
  whole = $state.raw<Signals | null>(null);
  private part = $state.raw<Signals | null>(null);
  private asked: Range | null = null;
  private turn = 0;
  /** Whether its motion's begin is its time 0, so that traces lie over each other; else its first sample is. */
  isAligned = $state(false);
  /** s beyond that begin, at which its time 0 is. */
  shift = $state(0);
  zero: number = $derived(this.isAligned && this.whole !== null ? motionBegin(this.whole) + this.shift : 0);
  private own: Signals | null = $derived(
    this.whole && this.part ? refined(this.whole, this.part) : this.whole,
  );
  /** What is drawn: the whole, finer where it is zoomed to. */
  signals: Signals | null = $derived(this.own && counted(this.own, this.zero));

  constructor(readonly id: string) {
    this.simulating = new Simulating(id, SIMULATING_REQUESTS);
  }

  get name(): string {
    return this.details === null ? this.id : traceName(this.details.entry);
  }

  /** Day and time at which it was recorded; empty until that is known. */
  get when(): string {
    return this.details === null ? '' : dayAndSecond(this.details.entry.created);
  }

  async load(): Promise<void> {
    this.problem = null;
    try {
      const params = { path: { ...here(), trace: this.id } };
      const details = await ask(api.GET('/api/v1/robots/{robot}/traces/{trace}', { params }));
      const signals = await this.ask(POINTS);
      this.details = details;
      this.whole = signals;
    } catch (error) {
      this.problem = asProblem(error);
    }
  }

  /** Asks for every sample of a part, where samples were left out and it is not there yet. */
  async refine(drawn: Range): Promise<void> {
    const { whole } = this;
    const shown = this.ownTime(drawn);
    if (whole === null || !isThinned(whole) || serves(this.asked, shown)) return;
    const turn = ++this.turn;
    this.asked = toAsk(shown, [whole.time[0]!, whole.time.at(-1)!]);
    try {
      const part = await this.ask(POINTS, this.asked);
      if (turn === this.turn) this.part = part;
    } catch (error) {
      if (turn !== this.turn) return;
      this.asked = null;
      this.problem = asProblem(error);
    }
  }

  /** Every sample between two moments, for measures. Throws a Problem. */
  async exactly(between: Range): Promise<Signals> {
    const isWhole = this.whole !== null && !isThinned(this.whole);
    return counted(isWhole ? this.whole! : await this.ask(EXACT, this.ownTime(between)), this.zero);
  }

  private ownTime([begin, end]: Range): Range {
    return [begin + this.zero, end + this.zero];
  }

  private async ask(points: number, range?: Range): Promise<TraceSignals> {
    const query = { points, ...(range ? { start: range[0], end: range[1] } : {}) };
    const params = { path: { ...here(), trace: this.id }, query };
    return ask(
      api.GET('/api/v1/robots/{robot}/traces/{trace}/data.json', { params }),
    ) as Promise<TraceSignals>;
  }
}
