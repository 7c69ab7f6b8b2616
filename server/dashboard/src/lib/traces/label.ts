/** What a trace is called where it is chosen: people know it by its name and its time, not by its number. */

import { dayAndSecond } from '../format';

export interface Named {
  readonly id: string;
  readonly name: string | null;
  readonly kind: string | null;
  readonly created: string;
  readonly outcome?: string | null;
}

/** Its name, else its kind. */
export function traceName(entry: Named): string {
  return entry.name ?? entry.kind?.replaceAll('_', ' ') ?? entry.id;
}

/**
 * `ramp, 21 Nov 2026, 10:22:05`: to the second, for a short motion is repeated within a minute. One that was not carried
 * out to its end says so.
 */
export function traceLabel(entry: Named): string {
  const ended = isWhole(entry) ? '' : ` (${outcomeText(entry)})`;
  return `${traceName(entry)}, ${dayAndSecond(entry.created)}${ended}`;
}

/** How its recording ended, for every place where traces are chosen. */
export function outcomeText(entry: Pick<Named, 'outcome'>): string {
  return entry.outcome ?? 'outcome not known';
}

/** px of a phone have room for about so many letters of a note. */
const NOTE = 60;

/** The part of a note for which a search found its trace; empty where none of its words is in it. */
export function noteFound(notes: string, query: string): string {
  const words = query
    .toLowerCase()
    .split(/\s+/)
    .filter((word) => word !== '');
  const line = notes.split('\n').find((one) => words.some((word) => one.toLowerCase().includes(word)));
  if (line === undefined) return '';
  const at = Math.min(...words.map((word) => line.toLowerCase().indexOf(word)).filter((one) => one >= 0));
  const from = Math.max(0, at - NOTE / 3);
  const part = line.slice(from, from + NOTE).trim();
  return `${from > 0 ? '…' : ''}${part}${from + NOTE < line.length ? '…' : ''}`;
}

/** Whether nothing ended its recording before its time, as far as is known. */
export function isWhole(entry: Pick<Named, 'outcome'>): boolean {
  return entry.outcome === 'complete' || entry.outcome == null;
}
