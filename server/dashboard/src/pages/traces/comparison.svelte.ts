/** The traces that are shown together: which ones (the address says it), which joints and signals, and how far it is zoomed. */

import { untrack } from 'svelte';
import { router } from '../../lib/router.svelte';
import { wholeRange, type Range, type Signals } from '../../lib/traces/columns';
import { besideOf, bestShift } from '../../lib/traces/compare';
import { moved, within, zoomed } from '../../lib/traces/zoom';
import { ShownTrace } from './shown_trace.svelte';

export const SIGNALS = ['position', 'error', 'drive'] as const;
export type ShownSignal = (typeof SIGNALS)[number];
export const BESIDE = ['difference', 'spectrum'] as const;
export type BesideName = (typeof BESIDE)[number];
export type Alignment = 'none' | 'begin' | 'best';
/** ms without a change of the zoom before details are asked for. */
const QUIET = 120;

export class Comparison {
  traces = $state.raw<readonly ShownTrace[]>([]);
  /** What is shown of the record, s; null for all. */
  range = $state.raw<Range | null>(null);
  signals = $state<ShownSignal[]>(['position', 'error']);
  /** Whether positions are shown less where the trace begins. */
  fromStart = $state(true);
  /** How several traces are laid over each other: by the begins of their motions, or where they lie best. */
  alignment = $state<Alignment>('begin');
  /** What is to be drawn beside the overlay. */
  chosenBeside = $state<readonly BesideName[]>([]);
  /** What is drawn beside it. */
  beside: readonly BesideName[] = $derived(besideOf(this.chosenBeside, this.traces.length));
  /** Chosen by hand; empty for those that moved. */
  chosenJoints = $state.raw<readonly number[]>([]);
  loaded: readonly ShownTrace[] = $derived(this.traces.filter((trace) => trace.signals !== null));
  whole: Range | null = $derived(wholeRange(this.loaded.map((trace) => trace.signals as Signals)));
  /** Joints that any of the traces has. */
  joints: readonly number[] = $derived(
    [...new Set(this.loaded.flatMap((trace) => trace.signals?.joints ?? []))].sort(),
  );
  /** Several traces are compared one joint at a time: colours tell the traces apart then. */
  isOneJoint: boolean = $derived(this.traces.length > 1);
  shownJoints: readonly number[] = $derived.by(() => this.jointsToShow());

  /** Follows the address: for an effect. */
  follow(): void {
    if (router.route.page !== 'traces') return; // the page is about to be left
    const ids = (router.route.rest[0] ?? '').split(',').filter((id) => id !== '');
    untrack(() => {
      const before = this.traces;
      if (ids.join() === before.map((trace) => trace.id).join()) return;
      this.traces = ids.map((id) => before.find((trace) => trace.id === id) ?? this.opened(id));
      if (!before.some((trace) => ids.includes(trace.id))) this.range = null;
    });
  }

  /** Several traces begin where their motions do, or are moved to where they lie best: for an effect. */
  align(): void {
    const { traces, alignment, isOneJoint } = this;
    const joint = this.shownJoints[0] ?? 1;
    const [first] = traces;
    for (const trace of traces) {
      trace.isAligned = isOneJoint && alignment !== 'none';
      const [one, other] = isOneJoint && alignment === 'best' ? [first?.whole, trace.whole] : [];
      trace.shift = one && other && one !== other ? bestShift(one, other, joint) : 0;
    }
  }

  isShown(id: string): boolean {
    return this.traces.some((trace) => trace.id === id);
  }

  /** Shows a trace beside the others, or takes it away. */
  toggle(id: string): void {
    const ids = this.traces.map((trace) => trace.id);
    this.show(this.isShown(id) ? ids.filter((one) => one !== id) : [...ids, id]);
  }

  show(ids: readonly string[]): void {
    if (ids.length === 0) router.go('traces');
    else router.go('traces', ids.join(','));
  }

  toggleJoint(joint: number): void {
    if (this.isOneJoint) this.chosenJoints = [joint];
    else if (!this.shownJoints.includes(joint)) this.chosenJoints = [...this.shownJoints, joint].sort();
    else if (this.shownJoints.length > 1) this.chosenJoints = this.shownJoints.filter((one) => one !== joint);
  }

  zoom(factor: number, about?: number): void {
    if (this.whole) this.range = zoomed(this.range, this.whole, factor, about);
  }

  move(share: number): void {
    if (this.whole) this.range = moved(this.range, this.whole, share);
  }

  zoomTo(range: Range | null): void {
    this.range = range && this.whole ? within(range, this.whole) : null;
  }

  /** Details of what is shown, when zooming has paused: for an effect. */
  refineSoon(): () => void {
    const { range, loaded } = this;
    if (range === null) return () => {};
    const timer = setTimeout(() => loaded.forEach((trace) => void trace.refine(range)), QUIET);
    return () => clearTimeout(timer);
  }

  private opened(id: string): ShownTrace {
    const trace = new ShownTrace(id);
    void trace.load();
    return trace;
  }

  private jointsToShow(): readonly number[] {
    const there = this.chosenJoints.filter((joint) => this.joints.includes(joint));
    const moved = this.loaded.flatMap((trace) => trace.details?.figures ?? []).filter((one) => one.moved);
    const usual = this.joints.filter((joint) => moved.some((one) => one.joint === joint));
    const joints = there.length > 0 ? there : usual.length > 0 ? usual : this.joints;
    return this.isOneJoint ? joints.slice(0, 1) : joints;
  }
}
