import { describe, expect, it } from 'vitest';
import { dayAndTime } from '../format';
import { traceLabel } from './label';

const created = '2026-11-21T10:22:00+00:00';

describe('a trace to be chosen', () => {
  it('is called by its name and time, else by its kind', () => {
    const time = dayAndTime(created);
    expect(traceLabel('9f3c', { name: 'ramp-3', kind: 'ramp', created })).toBe(`ramp-3, ${time}`);
    expect(traceLabel('9f3c', { name: null, kind: 'held_out', created })).toBe(`held out, ${time}`);
    expect(traceLabel('9f3c', { name: null, kind: null, created })).toBe(`9f3c, ${time}`);
  });

  it('is called by its number where it is gone', () => {
    expect(traceLabel('9f3c', undefined)).toBe('9f3c');
  });
});
