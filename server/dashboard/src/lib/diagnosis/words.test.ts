import { describe, expect, it } from 'vitest';
import { toneOfVerdict } from './words';

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
