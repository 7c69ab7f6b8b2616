/** Parameters of a model as dots with whiskers, on a scale that all of them share. */

import type { DiagnosisData, FittedParameter, ModelParameter, ParameterWords } from '../api/types';

/** What the data say: an interval; only a combination with others; nothing. `given`: it was not asked. */
export type Known = 'known' | 'combination' | 'unknown' | 'given';

export interface ParameterRow {
  name: string;
  /** Whose it is: joint 2, link 1, load. */
  group: string;
  /** What it is, beneath its group. */
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

/** How people write the parameters that a result names. Results of earlier versions have none. */
export type Words = Readonly<Record<string, ParameterWords>>;

/** A parameter where no heading says whose it is: J2 motor torque constant. */
export function parameterName(name: string, words: Words): string {
  return words[name]?.label ?? name;
}

/** One row a parameter of the model, with what was found of it. */
export function parameterRows(
  parameters: readonly ModelParameter[],
  found: ReadonlyMap<string, FoundInterval>,
): ParameterRow[] {
  return parameters.map((one) => {
    const own = found.get(one.name);
    return {
      name: one.name,
      group: one.words.group,
      short: one.words.short,
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
