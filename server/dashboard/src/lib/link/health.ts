/** The link's counters as a person reads them: which matter, what they mean, how fast they grow. Pure. */

import type { LinkMessage } from '../api/types';

export interface Figure {
  name: string;
  /** What it counts, for whoever points at it. */
  meaning: string;
  total: number;
  /** How many came in the last minute, or since the page was opened. */
  lately: number;
}

const LATE = 'Late samples';
const FIGURES: readonly (readonly [counter: string, name: string, meaning: string])[] = [
  ['retries', 'Retries', 'Requests written again because no whole reply came'],
  ['damaged', 'CRC errors', 'Pieces of input that were no whole reply: checksum, stuffing or length'],
  ['timeouts', 'Time-outs', 'Waits for a reply that ended without one'],
  ['torn', 'Torn readings', 'Readings caught with the bytes of two periods; none was delivered'],
  [
    'missed_set_points',
    'Missed set points',
    'Periods in which the controller did not take the set points sent',
  ],
  ['missing_samples', 'Missing samples', 'Periods of which no sample was delivered'],
  ['late', LATE, 'Samples that came more than one period after their tick'],
  ['restarts', 'Board restarts', 'Resets of the board that were noticed'],
];
/** s that "lately" looks back. */
export const LATELY = 60;

export interface Health {
  tone: 'good' | 'warn' | 'bad' | 'quiet';
  text: string;
  /** What a person can do; empty where nothing is to be done. */
  advice: string;
}

/** How the link does: nothing is healthy of which something was counted lately. */
export function healthOf(state: LinkMessage['state'] | 'none', figures: readonly Figure[]): Health {
  if (state === 'none') return { tone: 'quiet', text: 'not open', advice: '' };
  if (state === 'lost') return { tone: 'bad', text: 'lost', advice: '' };
  const most = figures.reduce<Figure | null>(
    (found, one) => (one.lately > (found?.lately ?? 0) ? one : found),
    null,
  );
  const late = figures.find((one) => one.name === LATE);
  const advice =
    late !== undefined && late.lately > 0
      ? 'Samples come late: this computer is busy, or the line is slow. End other programs on it.'
      : '';
  if (state === 'degraded') return { tone: 'warn', text: 'degraded', advice };
  if (most === null) return { tone: 'good', text: 'healthy', advice };
  return { tone: 'warn', text: most.name.toLowerCase(), advice };
}

/** Remembers what the counters were, to tell what is going on now from what once was. */
export class LinkHealth {
  private past: { at: number; counters: Record<string, number> }[] = [];

  /** Counters as told at `at` (s). */
  heard(message: LinkMessage, at: number): void {
    const last = this.past.at(-1);
    if (last !== undefined && (last.counters['requests'] ?? 0) > (message.counters['requests'] ?? 0))
      this.past = [];
    this.past.push({ at, counters: message.counters });
    while (this.past.length > 1 && (this.past[1]?.at ?? at) < at - LATELY) this.past.shift();
  }

  figures(): Figure[] {
    const now = this.past.at(-1)?.counters ?? {};
    const before = this.past[0]?.counters ?? {};
    return FIGURES.map(([counter, name, meaning]) => {
      const total = now[counter] ?? 0;
      return { name, meaning, total, lately: total - (before[counter] ?? 0) };
    });
  }

  /** ms of the slowest of a hundred replies; null before the first. */
  roundTrip(): number | null {
    const value = this.past.at(-1)?.counters['round_trip_p99_s'];
    return value === undefined ? null : value * 1000;
  }
}
