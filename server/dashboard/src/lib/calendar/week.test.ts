import { describe, expect, it } from 'vitest';
import type { PlannedRun } from '../api/types';
import { laterDay, weekOf } from './week';

const run = (at: Date, schedule: string | null): PlannedRun =>
  ({ at: at.toISOString(), schedule, experiment: null, name: 'ramp' }) as unknown as PlannedRun;

describe('a week', () => {
  it('has each run on its day, in order, and frequent ones of a schedule as one line', () => {
    const monday = laterDay(new Date(2026, 10, 25, 12), -2);
    const often = Array.from({ length: 24 }, (_, hour) => run(new Date(2026, 10, 24, hour), 'hourly'));
    const days = weekOf(monday, [
      ...often,
      run(new Date(2026, 10, 24, 2), 'nightly'),
      run(new Date(2026, 10, 29, 23, 59), null),
      run(new Date(2026, 10, 30), 'nightly'),
    ]);
    expect(days.map((day) => day.entries.map((one) => one.count))).toEqual([
      [],
      [24, 1],
      [],
      [],
      [],
      [],
      [1],
    ]);
    expect(days[1]!.entries[0]!.last.at).toBe(new Date(2026, 10, 24, 23).toISOString());
  });
});
