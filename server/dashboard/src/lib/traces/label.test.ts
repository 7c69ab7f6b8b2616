import { describe, expect, it } from 'vitest';
import { dayAndSecond } from '../format';
import { isWhole, noteFound, outcomeText, traceLabel } from './label';

const created = '2026-11-21T10:22:05+00:00';

it('shows the part of a note for which a search found its trace', () => {
  const notes = `cold start\n${'a long line of what was done before '.repeat(2)}new Grease on joint 2`;
  expect(noteFound(notes, 'grease')).toMatch(/^….*new Grease on joint 2$/);
  expect(noteFound(notes, 'cold')).toBe('cold start');
  expect(noteFound(notes, 'ramp')).toBe('');
  expect(noteFound(notes, '')).toBe('');
});

describe('a trace to be chosen', () => {
  it('is called by its name and time, else by its kind', () => {
    const time = dayAndSecond(created);
    expect(traceLabel({ id: '9f3c', name: 'ramp-3', kind: 'ramp', created })).toBe(`ramp-3, ${time}`);
    expect(traceLabel({ id: '9f3c', name: null, kind: 'held_out', created })).toBe(`held out, ${time}`);
    expect(traceLabel({ id: '9f3c', name: null, kind: null, created })).toBe(`9f3c, ${time}`);
  });

  it('says how it ended where that was before its end', () => {
    const entry = { id: '9f3c', name: 'ramp', kind: 'ramp', created };
    expect(traceLabel({ ...entry, outcome: 'stopped' })).toMatch(/ \(stopped\)$/);
    expect(traceLabel({ ...entry, outcome: 'complete' })).not.toContain('complete');
    expect([isWhole({ outcome: 'fault' }), isWhole({ outcome: null })]).toEqual([false, true]);
    expect(outcomeText({ outcome: null })).toBe('outcome not known');
  });

  it('is told from one of the same minute', () => {
    const [one, other] = ['10:22:05', '10:22:41'].map((time) =>
      traceLabel({ id: '9f3c', name: 'ramp', kind: 'ramp', created: `2026-11-21T${time}+00:00` }),
    );
    expect(one).not.toBe(other);
  });
});
