/** What the link's counters of a trace say: what went wrong, and how long an answer took. */

import { counterName } from '../link/health';

/** Seconds; the others are counts. */
const TIMES = ['round_trip_p50_s', 'round_trip_p99_s'] as const;
const ORDINARY = new Set([
  'requests',
  'samples',
  'round_trip_count',
  'round_trip_mean_s',
  'round_trip_max_s',
  ...TIMES,
]);

/** One line: everything that was counted and is not in order, then the round trip; empty where nothing was counted. */
export function linkInWords(counters: Readonly<Record<string, number>>): string {
  const wrong = Object.entries(counters)
    .filter(([name, count]) => count !== 0 && !ORDINARY.has(name))
    .map(([name, count]) => `${counterName(name)} ${count}`);
  const [usual, slow] = TIMES.map((name) => counters[name]);
  const trip =
    usual === undefined || slow === undefined
      ? []
      : [`round trip ${milliseconds(usual)}, 99 % within ${milliseconds(slow)}`];
  const requests = counters.requests === undefined ? [] : [`${counters.requests} requests`];
  const all = requests.length > 0 && wrong.length === 0 ? ['all answered in time'] : wrong;
  return [...requests, ...all, ...trip].join(', ');
}

function milliseconds(seconds: number): string {
  return `${Number((seconds * 1000).toPrecision(2))} ms`;
}
