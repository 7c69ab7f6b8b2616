import { expect, it } from 'vitest';
import type { Machine, TraceDetails } from '../api';
import { besideEarlier, isSameExperiment, limitsOf } from './earlier';

const figures = (error: number, drive: number): TraceDetails['figures'] =>
  [
    { joint: 2, unit: '°', moved: true, largest_error: error, largest_drive: drive },
  ] as TraceDetails['figures'];

it('tells a run beside earlier ones of the same experiment, and nothing where there are none', () => {
  const now = figures(3.9, 34);
  expect(besideEarlier(now, [], 'V')).toBe('');
  expect(besideEarlier(now, [figures(2.1, 34)], 'V')).toBe(
    'Differs from the earlier run (too few to judge by): J2 largest error 3.90°, was 2.10°.',
  );
  const usual = [figures(3.8, 33), figures(4, 34), figures(4.1, 35)];
  expect(besideEarlier(now, usual, 'V')).toMatch(/^As in the 3 earlier runs/);
  expect(besideEarlier(figures(9, 34), usual, 'V')).toBe(
    'Outside the range of the 3 earlier runs: J2 largest error 9.00°, was 3.80° to 4.10°.',
  );
});

it('are compared that are whole and of this service alone', () => {
  const run = (entry: object = {}): TraceDetails =>
    ({
      entry: { experiment: 'e1', outcome: 'complete', ...entry },
      record: { spec: { name: 'a' }, source: 'mock', robot: 'ma2000' },
    }) as TraceDetails;
  expect(isSameExperiment(run(), run({ experiment: 'e2' }))).toBe(true);
  expect(isSameExperiment(run({ outcome: 'stopped' }), run())).toBe(false);
  expect(isSameExperiment(run(), run({ experiment: null }))).toBe(false);
});

it('knows the limits that the machine file has, and no others', () => {
  const joint = {
    kind: 'revolute',
    sensor: { bits: 12, range: { value: Math.PI } },
    drive: { kind: 'dc_motor', supply_limit: { value: 36 } },
  };
  const machine = { joints: [joint], limits: { following_error_counts: 1024 } } as unknown as Machine;
  expect(limitsOf(machine, 1, 'V')).toEqual({ error: 45, drive: 36 });
  expect(limitsOf(machine, 1, 'A').drive).toBeNull();
  expect(limitsOf(null, 1, 'V')).toEqual({ error: null, drive: null });
});
