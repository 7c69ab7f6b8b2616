/** A week of plans: its days, and what is due on each, in this browser's time zone. Pure. */

import type { PlannedRun } from '../api/types';

export const DAYS = 7;
/** More runs of one schedule on a day than this are shown as one line. */
const MOST = 3;

/** Runs of one schedule on one day, or a single run. */
export interface Entry {
  readonly first: PlannedRun;
  readonly last: PlannedRun;
  readonly count: number;
}

export interface Day {
  readonly date: Date;
  readonly entries: readonly Entry[];
}

/** Midnight at the beginning of a day, some days later: a day need not have 24 hours. */
export function laterDay(day: Date, days = 0): Date {
  return new Date(day.getFullYear(), day.getMonth(), day.getDate() + days);
}

/** Seven days from `first` (its midnight), each with what is due on it. */
export function weekOf(first: Date, runs: readonly PlannedRun[]): Day[] {
  return Array.from({ length: DAYS }, (_, place) => {
    const date = laterDay(first, place);
    const end = laterDay(first, place + 1);
    const due = runs.filter((run) => {
      const at = Date.parse(run.at);
      return at >= date.getTime() && at < end.getTime();
    });
    return { date, entries: entriesOf(due) };
  });
}

function entriesOf(due: readonly PlannedRun[]): Entry[] {
  const groups = new Map<string, PlannedRun[]>();
  for (const run of due) {
    const key = run.schedule ?? run.experiment ?? run.at;
    groups.set(key, [...(groups.get(key) ?? []), run]);
  }
  const entries = [...groups.values()].flatMap((group): Entry[] =>
    group.length > MOST
      ? [{ first: group[0]!, last: group.at(-1)!, count: group.length }]
      : group.map((run) => ({ first: run, last: run, count: 1 })),
  );
  return entries.sort((one, other) => Date.parse(one.first.at) - Date.parse(other.first.at));
}
