import { describe, expect, it } from 'vitest';
import type { FleetComparison } from '../api/types';
import { dayAndTime } from '../format';
import { comparedWith, residualsOf, rowsOf, verdictOf } from './comparison';

type Arm = FleetComparison['robots'][number];

function fit(job: string, day: number, value: number): Arm['fits'][number] {
  return {
    job,
    at: `2026-01-${String(day).padStart(2, '0')}T00:00:00Z`,
    traces: ['t'],
    converged: true,
    whitened_mean_square: 1.05,
    residuals: [],
    numbers: [
      { name: 'a', unit: 'N·m', value, deviation: 0.01, low: value - 0.02, high: value + 0.02 },
      { name: 'b', unit: 's', value: 1, deviation: 0.1, low: 0.8, high: 1.2 },
    ],
  };
}

const change = (name: string, difference: number, changed: boolean): Arm['changes'][number] => ({
  name,
  unit: 'N·m',
  before: 0.2,
  after: 0.2 + difference,
  difference,
  low: difference - 0.03,
  high: difference + 0.03,
  changed,
});

const FLEET: FleetComparison = {
  experiments: ['ramp'],
  experiment: 'ramp',
  days: 30,
  words: { b: { joint: 1, group: 'joint 1', short: 'delay', label: 'J1 delay' } },
  robots: [
    {
      robot: 'left',
      fits: [fit('1', 1, 0.2), fit('2', 31, 0.21)],
      reference: '1',
      changes: [change('a', 0.01, false)],
    },
    {
      robot: 'right',
      fits: [fit('3', 1, 0.2), fit('4', 31, 0.5)],
      reference: '3',
      changes: [change('b', 0.3, true)],
    },
    { robot: 'new', fits: [], reference: null, changes: [] },
  ],
};

describe('the comparison of arms', () => {
  it('puts numbers that have changed first, and names them as people do', () => {
    const [first, second] = rowsOf(FLEET);
    expect([first!.label, first!.hasChanged]).toEqual(['J1 delay', true]);
    expect([second!.label, second!.hasChanged]).toEqual(['a', false]);
    expect(first!.cells.map((cell) => cell.change)).toEqual(['', '+0.30 (0.27 to 0.33)', '']);
  });

  it('shows the newest number with half of its interval, and all of them over time', () => {
    const cells = rowsOf(FLEET)[1]!.cells;
    expect(cells[0]).toMatchObject({ text: '0.210 ± 0.020', hasChanged: false });
    expect(cells[0]!.points.map((point) => point.value)).toEqual([0.2, 0.21]);
    expect(cells[2]).toMatchObject({ text: '', points: [] });
  });

  it('says which arms have changed, or that none has', () => {
    expect(verdictOf(FLEET)).toBe('Changed by more than the intervals allow: right.');
    const [left, , none] = FLEET.robots;
    expect(verdictOf({ ...FLEET, robots: [left!] })).toBe(
      'None of 1 numbers has changed by more than its interval allows.',
    );
    expect(verdictOf({ ...FLEET, robots: [none!] })).toBe('No arm has two fits that are 30 days apart.');
    expect(residualsOf(FLEET)).toEqual(['1.05', '1.05', '–']);
  });
});

it('says with which fit an arm is compared', () => {
  const arm: Arm = {
    robot: 'left',
    fits: [fit('old', 1, 0.2), fit('new', 9, 0.3)],
    reference: 'old',
    changes: [],
  };
  expect(comparedWith(arm)).toBe(`compared with ${dayAndTime('2026-01-01T00:00:00Z')}`);
  expect(comparedWith({ ...arm, reference: null })).toBe('no earlier fit');
});
