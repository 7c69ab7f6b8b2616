/** Two cursors on the time axis, and what lies between them. */

import { measureStep, ONE_GO, type StepMeasures } from '../../lib/steps/measures';
import { columnOf, type Range } from '../../lib/traces/columns';
import type { ShownTrace } from './shown_trace.svelte';

export interface MeasuredJoint {
  readonly trace: string;
  readonly joint: number;
  /** In rad, or m on a prismatic joint. */
  readonly measures: StepMeasures;
}

/** ms without a change before every sample between the cursors is asked for. */
const QUIET = 150;

export class Cursors {
  isOn = $state(false);
  a = $state(0);
  b = $state(0);
  measured = $state.raw<readonly MeasuredJoint[]>([]);
  between: Range = $derived([Math.min(this.a, this.b), Math.max(this.a, this.b)]);
  private turn = 0;

  /** Places both within what is shown: around the first motion where one begins there. */
  place(shown: Range, motions: readonly number[]): void {
    const begin = motions.find((moment) => moment >= shown[0] && moment < shown[1]);
    const span = shown[1] - shown[0];
    this.a = begin === undefined ? shown[0] + 0.1 * span : Math.max(shown[0], begin - ONE_GO);
    this.b = shown[1] - 0.02 * span;
    this.isOn = true;
  }

  /** Moves the nearer one. */
  moveTo(moment: number): void {
    if (Math.abs(moment - this.a) <= Math.abs(moment - this.b)) this.a = moment;
    else this.b = moment;
  }

  /** Measures when the cursors rest: for an effect. */
  measureSoon(traces: readonly ShownTrace[], joints: readonly number[]): () => void {
    const { between, isOn } = this;
    if (!isOn) {
      this.measured = [];
      return () => {};
    }
    const timer = setTimeout(() => void this.measure(traces, joints, between), QUIET);
    return () => clearTimeout(timer);
  }

  private async measure(
    traces: readonly ShownTrace[],
    joints: readonly number[],
    between: Range,
  ): Promise<void> {
    const turn = ++this.turn;
    const found = await Promise.all(traces.map((trace) => measuredOf(trace, joints, between)));
    if (turn === this.turn) this.measured = found.flat();
  }
}

async function measuredOf(
  trace: ShownTrace,
  joints: readonly number[],
  between: Range,
): Promise<MeasuredJoint[]> {
  const signals = await trace.exactly(between).catch(() => null);
  if (signals === null) return [];
  return joints.flatMap((joint) => {
    const position = columnOf(signals, 'position', joint);
    if (position === null) return [];
    const setPoint = columnOf(signals, 'set_point', joint);
    const measures = measureStep({ time: signals.time, position, setPoint }, ...between);
    return measures === null ? [] : [{ trace: trace.id, joint, measures }];
  });
}
