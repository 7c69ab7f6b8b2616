/** Candidates as bars of evidence. */

import type { DiagnosisData, DiagnosisStep, TriedEffect } from '../api/types';

export interface EvidenceBar {
  name: string;
  joint: number | null;
  /** Of fitted and held-out traces. */
  evidence: number;
  /** 0 to 1, of the best that was fitted; a probe's promise beyond it is cut off there. */
  width: number;
  misfit: number | null;
  refitted: boolean;
  /** What the answer names: alone, or as one of a group. */
  chosen: boolean;
  reason: string;
}

/** What was tried in one turn, and what it led to: an effect, or none. */
export type Turn = Pick<
  DiagnosisStep,
  'candidates' | 'group' | 'effect' | 'joints' | 'evidence' | 'evidence_held_out'
> & {
  /** Evidence from which an effect would have been named; null where one was, or where it is not told. */
  needed: number | null;
};

/** The turn of a step. */
export function turnOf(step: DiagnosisStep): Turn {
  return { ...step, needed: null };
}

/** The last turn of a diagnosis that added nothing; null where something was added, or nothing was tried. */
export function turnWithoutStep(found: DiagnosisData): Turn | null {
  if (found.steps.length > 0 || found.candidates.length === 0) return null;
  const { candidates, significant } = found;
  const needed = candidates.find((one) => one.needed != null)?.needed ?? significant;
  return {
    candidates,
    group: [],
    effect: null,
    joints: [],
    evidence: 0,
    evidence_held_out: null,
    needed,
  };
}

/**
 * The first `most` candidates of a turn: those that were fitted, best first, then those that a probe promises
 * something of. The two are not comparable: a fit shows what a candidate takes off, a probe what it might.
 */
export function evidenceBars(turn: Turn, most: number): EvidenceBar[] {
  const best = [...turn.candidates].sort((one, other) => total(other) - total(one));
  const ranked = [...best.filter((one) => one.refitted), ...best.filter((one) => !one.refitted)];
  const widest = Math.max(1, turn.needed ?? 1, ranked[0] ? total(ranked[0]) : 1);
  const named = namedIn(turn);
  return ranked.slice(0, most).map((one) => ({
    name: one.called,
    joint: one.joints[0] ?? null,
    evidence: total(one),
    width: Math.min(1, Math.max(0, total(one)) / widest),
    misfit: one.misfit,
    refitted: one.refitted,
    chosen: named.has(key(one)),
    reason: reasonOf(one, turn, named.has(key(one))),
  }));
}

/** Why a candidate stands where it stands, in one line. */
function reasonOf(one: TriedEffect, turn: Turn, chosen: boolean): string {
  if (chosen && turn.group.length > 1)
    return 'not distinguishable from the others of its group by these traces';
  if (chosen) return leadWords(turn);
  if (!one.refitted) return 'estimated by a quick probe, not fitted';
  if (total(one) <= 0) return 'explains less than its parameters cost';
  if (turn.needed !== null && total(one) < turn.needed)
    return `below the ${Math.round(turn.needed)} that are needed`;
  if (turn.effect === null) return 'rejected';
  return `explains ${Math.round(total(turn) - total(one))} less than the best`;
}

type Named = Pick<Turn, 'candidates' | 'group' | 'effect' | 'joints'>;

/** How far what is named leads every other effect that was fitted, by all traces. */
export function leadWords(turn: Named): string {
  const named = namedIn(turn);
  const fitted = turn.candidates.filter((one) => one.refitted);
  const best = (of: readonly TriedEffect[]): number => Math.max(...of.map(total));
  const others = fitted.filter((one) => !named.has(key(one)));
  const own = fitted.filter((one) => named.has(key(one)));
  if (others.length === 0 || own.length === 0) return 'no other effect was fitted';
  const lead = Math.round(best(own) - best(others));
  return lead < 0 ? `another effect has ${-lead} more` : `leads every other effect by ${lead}`;
}

/** The keys of what a turn names. */
export function namedIn(turn: Omit<Named, 'candidates'>): Set<string> {
  return new Set([key({ effect: turn.effect ?? '', joints: turn.joints }), ...turn.group.map(key)]);
}

/** What fitted and held-out traces say together. */
export function total(one: { evidence: number; evidence_held_out: number | null }): number {
  return one.evidence + (one.evidence_held_out ?? 0);
}

export function key(one: { effect: string; joints: readonly number[] }): string {
  return `${one.effect} ${one.joints.join(',')}`;
}
