/**
 * How the link does: one verdict for the header, Live and Health, over ten seconds, so that it says what the link does
 * and not what its last answer did. Beside it the counters as a person reads them. Pure; times in s.
 */

import type { LinkMessage } from '../api/types';

export interface Figure {
  name: string;
  /** What it counts, for whoever points at it. */
  meaning: string;
  total: number;
  /** How many came in the last `over` seconds. */
  lately: number;
}

export interface Health {
  tone: 'good' | 'warn' | 'bad' | 'quiet';
  text: string;
  /** What was wrong, and what a person can do; empty where nothing is. */
  why: string;
  figures: readonly Figure[];
  /** s that `lately` looks back: a minute, or since this page hears of the link. */
  over: number;
  /** ms of the slowest of a hundred replies; null before the first. */
  roundTrip: number | null;
}

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
  ['late', 'Late samples', 'Samples that came more than one period after their tick'],
  ['restarts', 'Board restarts', 'Resets of the board that were noticed'],
];
/** Within a sentence: a capital only where there are several. */
const within = (name: string): string => name.replace(/^[A-Z](?=[a-z])/, (one) => one.toLowerCase());

/** What a counter is called in a sentence. */
export const counterName = (counter: string): string =>
  within(FIGURES.find(([one]) => one === counter)?.[1] ?? counter.replaceAll('_', ' '));

/** s that "lately" looks back. */
export const LATELY = 60;
/** s that the verdict looks back, and for which a link stays degraded at least. */
export const OVER = 10;
/** Of all requests, the share that may go wrong: one in a hundred is lost in a trace's own noise. */
const MOST_WRONG = 0.01;
/** Share of the periods in real time below which the board's clock is slow: a mock's, on a busy computer. */
const LEAST_TICKS = 0.95;
const BUSY = 'The service’s computer is busy, or the line is slow: end other programs on that computer.';

/** The board's clock beside the host's, by the newest sample. */
export type Ticks = Readonly<{ tick: number; host_time: number }>;
interface Told {
  at: number;
  counters: Record<string, number>;
  ticks: Ticks | null;
}

/** What is said before anything was told of the link, and without a connection to the service. */
export const NOT_OPEN: Health = {
  tone: 'quiet',
  text: 'not open',
  why: '',
  figures: [],
  over: 0,
  roundTrip: null,
};

/** Remembers what the counters were, to tell what is going on now from what once was. */
export class LinkHealth {
  private past: Told[] = [];
  private degradedAt = -Infinity;
  private why = '';

  /** Counters as told at `at`. `period`: s of control; null while it is unknown. */
  heard(message: LinkMessage, at: number, ticks: Ticks | null = null, period: number | null = null): Health {
    const { counters, state } = message;
    if ((this.past.at(-1)?.counters['requests'] ?? 0) > (counters['requests'] ?? 0)) this.past = [];
    this.past.push({ at, counters, ticks });
    while (this.past.length > 1 && (this.past[1]?.at ?? at) < at - LATELY) this.past.shift();
    const trip = counters['round_trip_p99_s'];
    const told = {
      figures: this.figures(this.past[0]!),
      over: Math.round(at - this.past[0]!.at),
      roundTrip: trip === undefined ? null : trip * 1000,
    };
    if (state === 'none' || state === 'lost') {
      [this.past, this.degradedAt] = [[], -Infinity];
      return { ...told, ...(state === 'none' ? NOT_OPEN : { tone: 'bad', text: 'lost', why: '' }) };
    }
    const why = this.whatIsWrong(period);
    if (why !== '') [this.degradedAt, this.why] = [at, why];
    if (at - this.degradedAt < OVER) return { ...told, tone: 'warn', text: 'degraded', why: this.why };
    return { ...told, tone: 'good', text: 'healthy', why: '' };
  }

  /** What went wrong too often in the last ten seconds; empty for nothing. */
  private whatIsWrong(period: number | null): string {
    const now = this.past.at(-1)!;
    const before = this.past.findLast((one) => one.at <= now.at - OVER) ?? this.past[0]!;
    const wrong = this.figures(before).filter((one) => one.lately > 0);
    const requests = (now.counters['requests'] ?? 0) - (before.counters['requests'] ?? 0);
    const said = wrong.map((one) => `${within(one.name)} ${one.lately}`).join(', ');
    if (period !== null && now.ticks !== null && before.ticks !== null) {
      const passed = now.ticks.host_time - before.ticks.host_time;
      const share = ((now.ticks.tick - before.ticks.tick) * period) / passed;
      if (passed > OVER / 2 && share >= 0 && share < LEAST_TICKS)
        return `The board makes ${Math.round(100 * share)} % of its periods in time. ${BUSY}`;
    }
    const seconds = now.at - before.at;
    // A repeat is the remedy of what was counted already. What is seen in the first moments is held against ten seconds:
    // one late sample of the fifty of a first second is no link of which one in fifty is late.
    const faults = wrong.reduce((sum, one) => sum + (one.name === 'Retries' ? 0 : one.lately), 0);
    if (faults * Math.min(1, seconds / OVER) <= MOST_WRONG * requests) return '';
    return `Of ${requests} requests in ${Math.round(seconds)} s: ${said}. ${wrong.some((one) => one.name === 'Late samples') ? BUSY : ''}`;
  }

  private figures(before: Told): Figure[] {
    const now = this.past.at(-1)!.counters;
    return FIGURES.map(([counter, name, meaning]) => {
      const total = now[counter] ?? 0;
      return { name, meaning, total, lately: total - (before.counters[counter] ?? 0) };
    });
  }
}
