/** Columns for charts of a trace beside its simulations. */

import type { Overlay } from '../api/types';

const DEGREES = 180 / Math.PI;
const SHOWN: Record<string, [number, string]> = {
  rad: [DEGREES, '°'],
  m: [1000, 'mm'],
  'rad/s': [DEGREES, '°/s'],
  'm/s': [1000, 'mm/s'],
};

/** Factor and name of the unit in which people read. */
export function shownUnit(unit: string): [number, string] {
  return SHOWN[unit] ?? [1, unit];
}

type Column = (number | null)[];

/** A column a signal: time, set point, measured, then one for every model. `joint`: a place in `joints`. */
export function positionColumns(one: Overlay, joint: number): Column[] {
  const [factor] = shownUnit(one.units[joint] ?? 'rad');
  const scaled = (row: readonly (number | null)[] | undefined): Column => scale(row ?? [], factor);
  return [
    [...one.time],
    ...(one.set_point === null ? [] : [scaled(one.set_point[joint])]),
    scaled(one.measured[joint]),
    ...one.simulated.map((rows) => scaled(rows[joint])),
  ];
}

/** Time, then measured − simulated for every model. */
export function residualColumns(one: Overlay, joint: number): Column[] {
  const [factor] = shownUnit(one.units[joint] ?? 'rad');
  return [[...one.time], ...one.residual.map((rows) => scale(rows[joint] ?? [], factor))];
}

function scale(row: readonly (number | null)[], factor: number): Column {
  return row.map((value) => (value === null ? null : value * factor));
}
