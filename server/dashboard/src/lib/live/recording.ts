/**
 * The last minutes of samples, as columns to be drawn. Pure; times are the service's monotonic clock, in s.
 *
 * A row without a sample (a gap) stands between two samples that are further apart than the control period allows, so
 * that no line is drawn across what was not measured.
 */

import type { HistoryMessage, RecordEventMessage, SampleMessage } from '../api/types';

export const SIGNALS = ['set_point', 'position', 'error', 'drive'] as const;
export type Signal = (typeof SIGNALS)[number];
export type Column = (number | null)[];

/** Periods between two samples above which there is a gap. */
const GAP = 5;

export class Recording {
  readonly time: number[] = [];
  /** One column a joint, in the order of `joints`. */
  readonly columns: Record<Signal, Column[]> = { set_point: [], position: [], error: [], drive: [] };
  readonly events: RecordEventMessage[] = [];
  /** Grows with every change: what draws compares it. */
  version = 0;
  private lastTick: number | null = null;

  /** Keeps at least `seconds` s of samples of these joints, `period` s apart. */
  constructor(
    readonly joints: readonly number[],
    readonly period: number,
    readonly seconds: number,
  ) {
    for (const signal of SIGNALS) this.columns[signal] = joints.map(() => []);
  }

  get newest(): number | null {
    return this.time.at(-1) ?? null;
  }

  /** The past as the service has it: what is missing here is taken from it. What is here already stays. */
  addHistory(past: HistoryMessage): void {
    for (const [row, replaced] of this.holes()) this.fill(past, row, replaced);
    for (const event of past.events) this.addEvent(event);
    this.version += 1;
  }

  /** One more sample; one that is not newer than the newest is left out. */
  addSample(sample: SampleMessage): void {
    const newest = this.newest;
    if (newest !== null && sample.host_time <= newest) return;
    if (newest !== null && this.lastTick !== null && this.isGap(sample.tick - this.lastTick))
      this.addGap(newest);
    this.time.push(sample.host_time);
    for (const signal of SIGNALS) {
      const values = sample[signal];
      this.joints.forEach((joint, index) => {
        const place = sample.joints.indexOf(joint);
        this.columns[signal][index]?.push(place < 0 ? null : (values[place] ?? null));
      });
    }
    this.lastTick = sample.tick;
    this.version += 1;
    this.forget(sample.host_time - this.seconds);
  }

  /** Something in the record; the same thing is kept once. */
  addEvent(event: RecordEventMessage): void {
    const known = (other: RecordEventMessage): boolean =>
      other.kind === event.kind &&
      other.tick === event.tick &&
      other.joint === event.joint &&
      other.message === event.message;
    if (this.events.some(known)) return;
    this.events.push(event);
    this.version += 1;
  }

  /** The first row at or after `time`. */
  rowAt(time: number): number {
    let low = 0;
    let high = this.time.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if ((this.time[middle] as number) < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  private isGap(ticks: number): boolean {
    return ticks > GAP || ticks < 0;
  }

  private addGap(after: number): void {
    this.time.push(after + this.period / 2);
    for (const signal of SIGNALS) for (const column of this.columns[signal]) column.push(null);
  }

  /** Where something may be missing, the newest first: a row, and how many stand there for what is missing. */
  private holes(): (readonly [row: number, replaced: number])[] {
    const gaps = this.time.flatMap((_, row) => (this.isGapRow(row) ? [[row, 1] as const] : []));
    return [[this.time.length, 0] as const, ...gaps.reverse(), [0, 0] as const];
  }

  private isGapRow(row: number): boolean {
    return SIGNALS.every((signal) => this.columns[signal].every((column) => column[row] === null));
  }

  /** Half a period is kept on either side: the same sample's time is not rounded alike in a sample and in the past. */
  private fill(past: HistoryMessage, row: number, replaced: number): void {
    const before = this.time[row - 1] ?? -Infinity;
    const after = this.time[row + replaced] ?? Infinity;
    const begin = past.host_time.findIndex((time) => time > before + this.period / 2);
    const end = past.host_time.findLastIndex((time) => time < after - this.period / 2) + 1;
    if (begin < 0 || end <= begin) return;
    const time = past.host_time.slice(begin, end);
    const first = time[0] as number;
    const last = time[time.length - 1] as number;
    const opening = isFinite(before) && first - before > GAP * this.period ? [null] : [];
    const closing = isFinite(after) && after - last > GAP * this.period ? [null] : [];
    const half = this.period / 2;
    const times = [...opening.map(() => before + half), ...time, ...closing.map(() => last + half)];
    this.time.splice(row, replaced, ...times);
    this.eachColumn(past, (column, values) =>
      column.splice(row, replaced, ...opening, ...values.slice(begin, end), ...closing),
    );
    if (after === Infinity) this.lastTick = past.tick[end - 1] ?? this.lastTick;
  }

  private eachColumn(
    past: HistoryMessage,
    call: (column: Column, row: readonly (number | null)[]) => void,
  ): void {
    for (const signal of SIGNALS) {
      this.joints.forEach((joint, index) => {
        const place = past.joints.indexOf(joint);
        const row = past[signal][place] ?? past.host_time.map(() => null);
        call(this.columns[signal][index] as Column, row);
      });
    }
  }

  private forget(before: number): void {
    // Rarely, and many at once: to move all columns at every sample would cost more than drawing them.
    if ((this.time[0] ?? 0) > before - this.seconds / 4) return;
    const rows = this.rowAt(before);
    this.time.splice(0, rows);
    for (const signal of SIGNALS) for (const column of this.columns[signal]) column.splice(0, rows);
    const kept = this.events.filter((event) => event.host_time >= before);
    this.events.splice(0, this.events.length, ...kept);
  }
}
