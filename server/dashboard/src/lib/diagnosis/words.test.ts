import { describe, expect, it } from 'vitest';
import { notesApart, nothingNext, toneOfVerdict } from './words';

describe('the tone of a verdict', () => {
  it('is good where nothing was found on joints that could be examined', () => {
    expect(toneOfVerdict({ verdict: 'nothing-significant', not_examined: [], notes_data: [] })).toBe('good');
  });

  it('is a warning where nothing was found since joints were not examined', () => {
    expect(toneOfVerdict({ verdict: 'nothing-significant', not_examined: [2], notes_data: [] })).toBe('warn');
    const notes_data = [{ kind: 'limited-search', values: { joints: [2] } }] as never;
    expect(toneOfVerdict({ verdict: 'nothing-significant', not_examined: [], notes_data })).toBe('warn');
  });

  it('is that of what was found, whatever could not be examined beside it', () => {
    expect(toneOfVerdict({ verdict: 'named', not_examined: [2], notes_data: [] })).toBe('good');
    expect(toneOfVerdict({ verdict: 'unknown-effect', not_examined: [], notes_data: [] })).toBe('bad');
  });
});

it('to run next is nothing, but not without the warnings of an answer', () => {
  const note = (warning: boolean) => ({ kind: 'torque-left' as const, values: {}, warning });
  for (const verdict of ['named', 'nothing-significant'] as const) {
    const said = (warning: boolean): string =>
      nothingNext({ verdict, suspicion: null, notes_data: [note(warning)] });
    expect(said(false)).toMatch(/^Nothing: /);
    expect(said(true)).toContain('Read the warnings');
  }
  expect(notesApart({ notes: ['a', 'b'], notes_data: [note(false), note(true)] })).toEqual([['b'], ['a']]);
});
