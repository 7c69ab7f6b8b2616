/** Parameters of a model as dots with whiskers, on a scale that all of them share. */

import type { DiagnosisData, FittedParameter, ModelParameter } from '../api/types';

/** What the data say: an interval; only a combination with others; nothing. `given`: it was not asked. */
export type Known = 'known' | 'combination' | 'unknown' | 'given';

export interface ParameterRow {
  name: string;
  /** The part before the first dot: `joint2`, `link1`, `base`. */
  group: string;
  /** What is left of the name. */
  short: string;
  unit: string;
  value: number;
  /** 95 % interval; null where the data give none. */
  low: number | null;
  high: number | null;
  known: Known;
  reason: string;
  expected: number | null;
  /** Standard deviation of what is expected. */
  deviation: number | null;
}

/** Found by a fit or a diagnosis, by the parameter's name. */
export interface FoundInterval {
  low: number | null;
  high: number | null;
  known: Known;
  reason: string;
  expected: number | null;
  deviation: number | null;
}

/** What a fit says of its parameters. */
export function ofFit(parameters: readonly FittedParameter[]): Map<string, FoundInterval> {
  return new Map(
    parameters.map((one) => [
      one.name,
      {
        low: one.low,
        high: one.high,
        known: one.verdict,
        reason: one.reason,
        expected: one.expected,
        deviation: one.expected_deviation,
      },
    ]),
  );
}

/** What a diagnosis says of the parameters that it added. */
export function ofDiagnosis(found: Pick<DiagnosisData, 'steps'>): Map<string, FoundInterval> {
  const intervals = new Map<string, FoundInterval>();
  for (const step of found.steps.filter((one) => one.adopted)) {
    for (const [name, one] of Object.entries(step.parameters)) {
      const bounded = one.low !== null && one.high !== null;
      intervals.set(name, {
        low: one.low,
        high: one.high,
        known: bounded ? 'known' : 'unknown',
        reason: bounded ? 'added by the diagnosis' : 'these traces do not determine it',
        expected: null,
        deviation: null,
      });
    }
  }
  return intervals;
}

/** `joint2.motor.torque_constant` as people write it where no heading says whose it is: J2 motor torque constant. */
export function parameterName(name: string): string {
  const [group = '', ...rest] = name.split('.');
  const joint = /^joint(\d+)$/.exec(group);
  const whose = joint === null ? groupName(group) : `J${joint[1]}`;
  return [whose, ...rest.map(words)].join(' ');
}

/** A sentence of a fit with its parameters' names as people write them. */
export function inWords(text: string): string {
  return text.replace(/\b[a-z]+\d*(\.[a-z_\d]*[a-z][a-z_\d]*)+/g, parameterName).replace(/ -(?=\d)/g, ' −');
}

/** Words of one part of a parameter's name. */
function words(part: string): string {
  return part
    .replaceAll('_dependent', '-dependent')
    .replace('back_emf', 'back-EMF')
    .replace(/^coulomb/, 'Coulomb')
    .replace(/^stribeck/, 'Stribeck')
    .replaceAll('_', ' ');
}

/** One row a parameter of the model, with what was found of it. */
export function parameterRows(
  parameters: readonly ModelParameter[],
  found: ReadonlyMap<string, FoundInterval>,
): ParameterRow[] {
  return parameters.map((one) => {
    const [group = '', ...rest] = one.name.split('.');
    const own = found.get(one.name);
    return {
      name: one.name,
      group,
      short: rest.length === 0 ? one.name : rest.map(words).join(' '),
      unit: one.unit,
      value: one.value,
      low: own?.low ?? null,
      high: own?.high ?? null,
      known: own?.known ?? 'given',
      reason: own?.reason ?? 'was not fitted',
      expected: own?.expected ?? null,
      deviation: own?.deviation ?? one.deviation,
    };
  });
}

/** Whiskers end here: expected deviations either side. */
export const SCALE_END = 3;

export interface Whisker {
  /** 0 to 1 across the plot; 0.5 is what was expected. */
  dot: number;
  low: number | null;
  high: number | null;
  /** Whether something lies beyond the scale's ends. */
  cut: boolean;
}

/**
 * Where dot and whiskers of a parameter lie, in expected deviations from what was expected. Null where nothing is
 * expected of it: then there is no scale that it shares with the others.
 */
export function whisker(row: ParameterRow): Whisker | null {
  if (row.deviation === null || !(row.deviation > 0)) return null;
  const deviation = row.deviation;
  const expected = row.expected ?? row.value;
  const place = (value: number): number => 0.5 + (value - expected) / deviation / (2 * SCALE_END);
  const within = (value: number): number => Math.min(1, Math.max(0, value));
  const places = [row.value, row.low, row.high].filter((value) => value !== null).map(place);
  return {
    dot: within(place(row.value)),
    low: row.low === null ? null : within(place(row.low)),
    high: row.high === null ? null : within(place(row.high)),
    cut: places.some((one) => one < 0 || one > 1),
  };
}

/** Rows under their groups, in the order in which these first come. */
export function grouped(rows: readonly ParameterRow[]): [string, ParameterRow[]][] {
  const groups = new Map<string, ParameterRow[]>();
  for (const row of rows) groups.set(row.group, [...(groups.get(row.group) ?? []), row]);
  return [...groups];
}

const GROUP_WORD = /^([a-z]+?)(\d+)$/;

/** `joint2` as people write it. */
export function groupName(group: string): string {
  const found = GROUP_WORD.exec(group);
  return found === null ? group.replaceAll('_', ' ') : `${found[1]} ${found[2]}`;
}
