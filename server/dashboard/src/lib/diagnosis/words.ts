/** What the page calls phases of motion, and the tone of each verdict. */

import type { DiagnosisData, PhaseCell } from '../api/types';
import type { Tone } from '../jobs/jobs';
import { examinedJoints } from './story';

export type Phase = PhaseCell['phase'];
export type Verdict = DiagnosisData['verdict'];

/** In the order in which the map shows them. */
export const PHASES: readonly Phase[] = ['ramp_start', 'steady_ramp', 'reversal', 'creep', 'hold'];

export const PHASE_NAMES: Record<Phase, string> = {
  ramp_start: 'start',
  steady_ramp: 'steady',
  reversal: 'reversal',
  creep: 'creep',
  hold: 'hold',
};

export const PHASE_MEANINGS: Record<Phase, string> = {
  ramp_start: 'the first 0.3 s of a motion',
  steady_ramp: 'at steady speed',
  reversal: '0.5 s after a change of direction',
  creep: 'below 6 °/s',
  hold: 'at rest',
};

const TONES: Record<Verdict, Tone> = {
  'nothing-significant': 'good',
  named: 'good',
  ambiguous: 'warn',
  partly: 'warn',
  suspected: 'warn',
  'unknown-effect': 'bad',
  'check-the-record': 'bad',
};

/** The tone of a verdict; nothing found is no good news of joints that were not examined. */
export function toneOfVerdict(found: Pick<DiagnosisData, 'verdict' | 'not_examined' | 'notes_data'>): Tone {
  const isPart = (found.not_examined ?? []).length > 0 || examinedJoints(found) !== undefined;
  return found.verdict === 'nothing-significant' && isPart ? 'warn' : TONES[found.verdict];
}

/** `a`, `a and b`, `a, b and c`. */
export function listed(names: readonly string[], last = 'and'): string {
  if (names.length < 2) return names.join('');
  return `${names.slice(0, -1).join(', ')} ${last} ${names.at(-1) ?? ''}`;
}

/** The notes of an answer: those that warn, and the others. */
export function notesApart(found: Pick<DiagnosisData, 'notes' | 'notes_data'>): [string[], string[]] {
  const isWarning = (index: number): boolean => found.notes_data?.[index]?.warning ?? false;
  return [
    found.notes.filter((_, index) => isWarning(index)),
    found.notes.filter((_, index) => !isWarning(index)),
  ];
}

/** What to do next where no experiment is proposed. */
export function nothingNext(found: Pick<DiagnosisData, 'verdict' | 'suspicion' | 'notes_data'>): string {
  if (found.suspicion) {
    return `Record ${Math.ceil(found.suspicion.seconds)} s more of the same motion: it would show or refute the effect.`;
  }
  const isDoubted = found.notes_data?.some((note) => note.warning) ?? false;
  if (found.verdict === 'named')
    return isDoubted
      ? 'No further record is needed for the name. Read the warnings before you use the model.'
      : 'Nothing: these records separate the name from every other candidate. Use the model with the effect.';
  if (found.verdict === 'nothing-significant' && examinedJoints(found) !== undefined)
    return 'Diagnose the other joints too: the search was limited.';
  if (found.verdict === 'nothing-significant')
    return isDoubted
      ? 'No experiment is proposed. Read the warnings: no effect that was tried explains them.'
      : 'Nothing: no effect has the evidence to be named.';
  if (found.verdict === 'check-the-record')
    return 'Check what is doubted about the records, then diagnose again.';
  return 'No experiment is proposed. Look at what is left, and at the candidates, below.';
}
