/** What the names of a diagnosis are called on the page. */

import type { DiagnosisData, PhaseCell, TriedEffect } from '../api/types';

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

export const VERDICTS: Record<Verdict, { title: string; tone: 'good' | 'warn' | 'bad' | 'quiet' }> = {
  'nothing-significant': { title: 'Nothing significant is missing', tone: 'good' },
  named: { title: 'Named', tone: 'good' },
  ambiguous: { title: 'One of several candidates', tone: 'warn' },
  suspected: { title: 'An effect is suspected', tone: 'warn' },
  'unknown-effect': { title: 'An unknown effect', tone: 'bad' },
};

/** Names that keep their capital letters. */
const PROPER: Record<string, string> = { coulomb: 'Coulomb', stribeck: 'Stribeck', emf: 'EMF' };

/** `back_emf_error` as people write it: back-EMF error. */
export function effectName(name: string): string {
  if (name.startsWith('back_emf'))
    return `back-EMF ${name.slice('back_emf_'.length).replaceAll('_', ' ')}`.trim();
  const words = name.replaceAll('_dependent', '-dependent').split('_');
  return words.map((word) => PROPER[word] ?? word).join(' ');
}

/** An effect and its joints: "Coulomb friction, joint 2". */
export function candidateName(one: Pick<TriedEffect, 'effect' | 'joints'>): string {
  if (one.joints.length === 0) return effectName(one.effect);
  const several = one.joints.length > 1 ? 's' : '';
  return `${effectName(one.effect)}, joint${several} ${listed(one.joints.map(String))}`;
}

/** `a`, `a and b`, `a, b and c`. */
export function listed(names: readonly string[], last = 'and'): string {
  if (names.length < 2) return names.join('');
  return `${names.slice(0, -1).join(', ')} ${last} ${names.at(-1) ?? ''}`;
}

/** What was found, as a headline. */
export function verdictTitle(
  found: Pick<DiagnosisData, 'verdict' | 'steps'> & Partial<Pick<DiagnosisData, 'suspicion'>>,
): string {
  if (found.verdict === 'suspected' && found.suspicion) return `Suspected: ${candidateName(found.suspicion)}`;
  const names = found.steps
    .filter((step) => step.adopted && step.effect !== null)
    .map((step) => candidateName({ effect: step.effect ?? '', joints: step.joints }));
  if (found.verdict === 'named') {
    return `${capital(listed(names))} ${names.length > 1 ? 'are' : 'is'} missing from the model`;
  }
  const group = found.verdict === 'ambiguous' ? (found.steps.at(-1)?.group ?? []) : [];
  if (group.length > 0 && group.length <= 3) return `Either ${listed(group.map(candidateName), 'or')}`;
  if (found.verdict === 'unknown-effect' && names.length > 0) {
    return `${capital(listed(names))}, and an unknown effect`;
  }
  return VERDICTS[found.verdict].title;
}

function capital(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}
