/** The arms' fits to the same experiment as a table: a row a number, a column an arm. Pure. */

import type { FleetComparison } from '../api/types';
import { dayAndTime, significant } from '../format';

export interface Point {
  /** ms since 1970. */
  at: number;
  value: number;
  low: number;
  high: number;
}

export interface Cell {
  /** The number of the newest fit, with half of its 95 % interval; empty where it was not determined. */
  text: string;
  points: readonly Point[];
  /** What has changed since the reference, with the interval of the difference; empty without one. */
  change: string;
  hasChanged: boolean;
}

export interface Row {
  name: string;
  label: string;
  unit: string;
  /** In the order of the arms. */
  cells: readonly Cell[];
  hasChanged: boolean;
}

/** The numbers that any arm's fits have determined; those that have changed come first. */
export function rowsOf(comparison: FleetComparison): readonly Row[] {
  const units = new Map<string, string>();
  for (const arm of comparison.robots)
    for (const fit of arm.fits) for (const one of fit.numbers) units.set(one.name, one.unit);
  const rows = [...units].map(([name, unit]) => {
    const cells = comparison.robots.map((arm) => cellOf(arm, name));
    const label = comparison.words[name]?.label ?? name;
    return { name, label, unit, cells, hasChanged: cells.some((cell) => cell.hasChanged) };
  });
  return rows.sort((one, other) => Number(other.hasChanged) - Number(one.hasChanged));
}

function cellOf(arm: FleetComparison['robots'][number], name: string): Cell {
  const points = arm.fits.flatMap((fit) =>
    fit.numbers
      .filter((one) => one.name === name)
      .map(({ value, low, high }) => ({ at: Date.parse(fit.at), value, low, high })),
  );
  const newest = arm.fits.at(-1)?.numbers.find((one) => one.name === name);
  const change = arm.changes.find((one) => one.name === name);
  return {
    text:
      newest === undefined
        ? ''
        : `${significant(newest.value)} ± ${significant((newest.high - newest.low) / 2, 2)}`,
    points,
    change:
      change === undefined
        ? ''
        : `${change.difference > 0 ? '+' : ''}${significant(change.difference, 2)} (${significant(change.low, 2)} to ${significant(change.high, 2)})`,
    hasChanged: change?.changed ?? false,
  };
}

/** How much of the noise is explained, of the newest fit of each arm: 1 is all of it. */
export function residualsOf(comparison: FleetComparison): readonly string[] {
  return comparison.robots.map((arm) => significant(arm.fits.at(-1)?.whitened_mean_square, 3));
}

/** With which fit an arm's newest one is compared. */
export function comparedWith(arm: FleetComparison['robots'][number]): string {
  const reference = arm.fits.find((fit) => fit.job === arm.reference);
  return reference === undefined ? 'no earlier fit' : `compared with ${dayAndTime(reference.at)}`;
}

/** What is to be said of the whole, in one line. */
export function verdictOf(comparison: FleetComparison): string {
  const compared = comparison.robots.filter((arm) => arm.reference !== null);
  const within = comparison.days === 1 ? '1 day' : `${comparison.days} days`;
  if (compared.length === 0) return `No arm has two fits that are ${within} apart.`;
  const changed = compared.filter((arm) => arm.changes.some((one) => one.changed));
  const names = changed.map((arm) => arm.robot).join(', ');
  const numbers = compared.reduce((sum, arm) => sum + arm.changes.length, 0);
  if (numbers === 0) return 'No number was determined by two fits of the same arm.';
  return changed.length === 0
    ? `None of ${numbers} numbers has changed by more than its interval allows.`
    : `Changed by more than the intervals allow: ${names}.`;
}
