import { describe, expect, it } from 'vitest';
import type { Fidelity, FittedParameter, ModelParameter, ParameterWords } from '../api/types';
import { contributionBar, curvePicture, pathOf, type Distortion } from './distortion';
import { grouped, ofDiagnosis, ofFit, parameterName, parameterRows, whisker } from './parameters';

const said = (joint: number | null, group: string, short: string): ParameterWords => ({
  joint,
  group,
  short,
  label: `${group} ${short}`,
});
const WORDS = {
  'joint2.motor.resistance': said(2, 'joint 2', 'motor resistance'),
  'link1.mass': said(1, 'link 1', 'mass'),
  'load.mass': said(null, 'load', 'mass'),
};
const parameter = (name: keyof typeof WORDS, value: number, deviation: number | null): ModelParameter => ({
  name,
  words: WORDS[name],
  unit: 'kg',
  value,
  low: 0,
  high: null,
  deviation,
});
const fitted = (name: string, low: number | null, high: number | null): FittedParameter =>
  ({
    name,
    low,
    high,
    verdict: low === null ? 'unknown' : 'known',
    reason: 'so',
    expected: 1,
    expected_deviation: 0.1,
  }) as FittedParameter;

describe('parameters', () => {
  const rows = parameterRows(
    [
      parameter('joint2.motor.resistance', 1.1, 0.1),
      parameter('link1.mass', 3, 0.2),
      parameter('load.mass', 0.5, null),
    ],
    ofFit([fitted('joint2.motor.resistance', 1.0, 1.5), fitted('link1.mass', null, null)]),
  );

  it('are called as the service writes them for people, and by their names where it does not say', () => {
    expect(parameterName('link1.mass', WORDS)).toBe('link 1 mass');
    expect(parameterName('link9.mass', WORDS)).toBe('link9.mass');
  });

  it('carry what a fit found of them', () => {
    expect(rows.map((one) => [one.group, one.short, one.known])).toEqual([
      ['joint 2', 'motor resistance', 'known'],
      ['link 1', 'mass', 'unknown'],
      ['load', 'mass', 'given'],
    ]);
    expect(grouped(rows).map(([group]) => group)).toEqual(['joint 2', 'link 1', 'load']);
  });

  it('lie on one scale: deviations from what was expected', () => {
    const first = whisker(rows[0]!);
    expect(first?.dot).toBeCloseTo(0.5 + 1 / 6);
    expect(first?.low).toBeCloseTo(0.5);
    expect(first).toMatchObject({ high: 1, cut: true });
    expect(whisker(rows[1]!)).toMatchObject({ low: null, high: null });
    expect(whisker(rows[2]!)).toBeNull();
  });

  it('of a diagnosis are those that it added to the model', () => {
    const value = { value: 3, low: 2, high: 4, unit: 'N·m' };
    const step = { adopted: true, parameters: { 'joint2.coulomb_friction.torque': value } };
    const other = { adopted: false, parameters: { 'joint1.backlash.play': value } };
    const found = ofDiagnosis({ steps: [step, other] } as never);
    expect([...found.keys()]).toEqual(['joint2.coulomb_friction.torque']);
  });
});

const distortion = (name: string, contribution: number, required: number | null = 1): Distortion =>
  ({ name, contribution, required, value: 2, expected: 0.5 }) as Distortion;

describe('Σλ²', () => {
  it('is a bar whose parts add up, against 1', () => {
    const bar = contributionBar([distortion('a', 0.1), distortion('b', 0.3), distortion('c', 0)], {}, 5);
    expect(bar.parts.map((one) => one.name)).toEqual(['b', 'a']);
    expect(bar.parts.at(-1)?.end).toBeCloseTo(0.4);
    expect([bar.scale, bar.one]).toEqual([1, 1]);
  });

  it('knows whose parameters they are', () => {
    const names = ['joint2.motor.resistance', 'link1.mass', 'load.mass', 'other', 'more'];
    const bar = contributionBar(
      names.map((name, index) => distortion(name, 5 - index)),
      WORDS,
      4,
    );
    expect(bar.parts.map((one) => one.joint)).toEqual([2, 1, null, null, null]);
  });

  it('beyond 1 fills the bar, and small parts become one', () => {
    const bar = contributionBar([distortion('a', 3), distortion('b', 0.5), distortion('c', 0.5)], {}, 1);
    expect(bar.parts.map((one) => one.name)).toEqual(['a', '2 more']);
    expect(bar.parts.at(-1)?.end).toBeCloseTo(1);
    expect(bar.one).toBe(0.25);
  });
});

describe('curves of the error', () => {
  const found = {
    error: 1,
    parameters: [distortion('a', 1), distortion('flat', 0, null)],
    curves: [],
  } as unknown as Fidelity;

  it('are drawn over their range, with breaks where a simulation diverged', () => {
    const curve = {
      name: 'a',
      unit: 'kg',
      values: [1, 1.5, 2, 2.5, 3, 3.5],
      errors: [2, 1.2, null, 1, 2, 40],
    };
    const picture = curvePicture(curve, found);
    expect(picture?.lines.map((line) => line.length)).toEqual([2, 3]);
    expect(picture?.lines[0]?.[0]).toEqual([0, 0.5]);
    expect(picture?.value).toBeCloseTo(0.4);
    expect(picture?.flat).toBe(false);
    expect(picture?.lines[1]?.[2]?.[1]).toBeGreaterThanOrEqual(-0.5);
  });

  it('say when nothing doubles the error, and are left out without a width', () => {
    expect(curvePicture({ name: 'flat', unit: '', values: [1, 3], errors: [1, 1] }, found)?.flat).toBe(true);
    expect(curvePicture({ name: 'a', unit: '', values: [1], errors: [1] }, found)).toBeNull();
    expect(curvePicture({ name: 'other', unit: '', values: [1, 2], errors: [1, 1] }, found)).toBeNull();
  });

  it('become paths', () => {
    expect(
      pathOf(
        [
          [0, 0.5],
          [1, 0],
        ],
        100,
        40,
      ),
    ).toBe('M0.0 20.0L100.0 0.0');
  });
});
