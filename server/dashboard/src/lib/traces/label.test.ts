import { describe, expect, it } from 'vitest';
import { dayAndSecond } from '../format';
import { traceLabel } from './label';

const created = '2026-11-21T10:22:05+00:00';

describe('a trace to be chosen', () => {
  it('is called by its name and time, else by its kind', () => {
    const time = dayAndSecond(created);
    expect(traceLabel({ id: '9f3c', name: 'ramp-3', kind: 'ramp', created })).toBe(`ramp-3, ${time}`);
    expect(traceLabel({ id: '9f3c', name: null, kind: 'held_out', created })).toBe(`held out, ${time}`);
    expect(traceLabel({ id: '9f3c', name: null, kind: null, created })).toBe(`9f3c, ${time}`);
  });

  it('is told from one of the same minute', () => {
    const [one, other] = ['10:22:05', '10:22:41'].map((time) =>
      traceLabel({ id: '9f3c', name: 'ramp', kind: 'ramp', created: `2026-11-21T${time}+00:00` }),
    );
    expect(one).not.toBe(other);
  });
});
