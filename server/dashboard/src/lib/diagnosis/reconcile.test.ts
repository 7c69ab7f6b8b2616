import { describe, expect, it } from 'vitest';
import type { DiagnosisData, PhaseCell } from '../api/types';
import { cellMeaning, whyNotCounted } from './reconcile';

const candidate = (effect: string, evidence: number): unknown => ({ effect, joints: [2], evidence });
const found = (
  verdict: DiagnosisData['verdict'],
  significant: number | null = 30,
): Pick<DiagnosisData, 'verdict' | 'steps' | 'significant'> =>
  ({
    verdict,
    significant,
    steps: [{ candidates: [candidate('backlash', 1), candidate('coulomb_friction', 4.4)] }],
  }) as unknown as DiagnosisData;

describe('a residual that goes with something although nothing is missing', () => {
  it('is told why it does not count, with what came nearest', () => {
    expect(whyNotCounted(found('nothing-significant'), { joint: null })).toBe(
      'σ says how certain the dependence is, not how large: no joint is off by more than noise. ' +
        'This is not a finding: an effect is named from evidence 30 on; the best, Coulomb friction, joint 2, has evidence 4.',
    );
  });

  it('is not said to be within noise where a joint is off', () => {
    const said = whyNotCounted(found('nothing-significant'), { joint: 2 });
    expect(said).not.toContain('noise');
    expect(said).toContain('evidence 30');
  });

  it('names no number that an older answer does not tell', () => {
    const said = whyNotCounted(found('nothing-significant', null), { joint: 2 });
    expect(said).toBe('This is not a finding: the best, Coulomb friction, joint 2, has evidence 4.');
  });

  it('needs no word where something is named', () => {
    expect(whyNotCounted(found('named'), { joint: 2 })).toBe('');
    expect(whyNotCounted(found('unknown-effect'), { joint: null })).toBe('');
  });
});

describe('a cell of the map', () => {
  const cell = (mean_square: number, significance: number, trace = 0): PhaseCell => ({
    joint: 1,
    start: 0,
    end: 0.3,
    phase: 'hold',
    mean_square,
    significance,
    trace,
  });

  it('is a window, which chance takes further than a whole phase', () => {
    const said = cellMeaning([cell(1, 0), cell(3.61, 2.5), cell(25, 9), cell(100, 9, 1)], 0, 3);
    expect(said).toContain('one window of 0.3 s');
    expect(said).toContain('up to 1.9 times');
    expect(said).toContain('Beyond chance: 1 of 3 windows.');
  });

  it('says nothing of chance where every window is beyond it, and nothing without windows', () => {
    expect(cellMeaning([cell(25, 9)], 0, 3)).not.toContain('times');
    expect(cellMeaning([cell(25, 9)], 1, 3)).toBe('');
  });
});
