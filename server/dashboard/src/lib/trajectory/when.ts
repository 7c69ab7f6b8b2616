/** Moments and intervals of experiments: as they are chosen in a form, and as they are told. */

import { dayAndTime } from '../format';

export const UNITS = { s: 1, min: 60, h: 3600, d: 86400 } as const;
export type Unit = keyof typeof UNITS;

/** Value of a `datetime-local` field, in this browser's time zone, as the service wants it; null when it is no moment. */
export function momentOf(local: string): string | null {
  const moment = new Date(local);
  return local === '' || Number.isNaN(moment.getTime()) ? null : moment.toISOString();
}

/** A moment as a `datetime-local` field shows it. */
export function localMoment(moment: Date): string {
  const two = (value: number): string => String(value).padStart(2, '0');
  const day = `${moment.getFullYear()}-${two(moment.getMonth() + 1)}-${two(moment.getDate())}`;
  return `${day}T${two(moment.getHours())}:${two(moment.getMinutes())}`;
}

/** A duration in its largest even unit, such as `30 min`; to a tenth where none is even. */
export function interval(seconds: number): string {
  const units = (Object.entries(UNITS) as [Unit, number][]).reverse();
  const [unit, size] = units.find(([, one]) => seconds >= one && Number.isInteger(seconds / one)) ??
    units.find(([, one]) => seconds >= one) ?? ['s', 1];
  return `${Number((seconds / size).toFixed(1))} ${unit}`;
}

/** Days of the week as cron numbers them, from Monday. */
export const WEEKDAYS = [
  [1, 'Mon'],
  [2, 'Tue'],
  [3, 'Wed'],
  [4, 'Thu'],
  [5, 'Fri'],
  [6, 'Sat'],
  [0, 'Sun'],
] as const;

/** The cron expression of a time of day: `02:00`. `days`: weekdays by cron's numbers; all of them is every day. */
export function cronOf(time: string, days: readonly number[] = []): string {
  const [hour, minute] = time.split(':').map(Number);
  const isDaily = days.length === 0 || days.length === WEEKDAYS.length;
  return `${minute} ${hour} * * ${isDaily ? '*' : days.toSorted().join(',')}`;
}

/** How long until a moment, or since: `in 5 min`, `2 h ago`, `now`; from a day ahead its date. */
export function fromNow(moment: string, now: number): string {
  const seconds = (Date.parse(moment) - now) / 1000;
  const size = Math.abs(seconds);
  if (size < 1) return 'now';
  if (seconds >= UNITS.d) return `on ${dayAndTime(moment)}`;
  const rounded =
    size < 60 ? Math.round(size) : size < 3600 ? Math.round(size / 60) * 60 : Math.round(size / 3600) * 3600;
  const text = rounded >= 2 * UNITS.d ? `${Math.round(size / UNITS.d)} d` : interval(rounded);
  return seconds > 0 ? `in ${text}` : `${text} ago`;
}
