/** Candidates as bars of evidence. */

import type { DiagnosisStep, TriedEffect } from '../api/types';
import { candidateName } from './words';

export interface EvidenceBar {
  name: string;
  joint: number | null;
  evidence: number;
  /** 0 to 1, of the best. */
  width: number;
  misfit: number | null;
  refitted: boolean;
  /** What the answer names: alone, or as one of a group. */
  chosen: boolean;
  reason: string;
}

/** The best `most` candidates of a step, best first. */
export function evidenceBars(step: DiagnosisStep, most: number): EvidenceBar[] {
  const ranked = [...step.candidates].sort((one, other) => other.evidence - one.evidence).slice(0, most);
  const best = Math.max(1, ranked[0]?.evidence ?? 1);
  const named = new Set(step.group.map(key));
  if (step.effect !== null) named.add(key({ effect: step.effect, joints: step.joints }));
  return ranked.map((one) => ({
    name: candidateName(one),
    joint: one.joints[0] ?? null,
    evidence: one.evidence,
    width: Math.max(0, one.evidence) / best,
    misfit: one.misfit,
    refitted: one.refitted,
    chosen: named.has(key(one)),
    reason: reasonOf(one, step, named.has(key(one))),
  }));
}

/** Why a candidate stands where it stands, in one line. */
function reasonOf(one: TriedEffect, step: DiagnosisStep, chosen: boolean): string {
  const behind = step.evidence - one.evidence;
  if (chosen && step.group.length > 1) return 'these traces cannot tell it from the others of its group';
  if (chosen) return `leads by ${Math.round(step.margin)} over the next other answer`;
  if (!one.refitted) return 'a probe promised too little for a fit';
  if (one.evidence <= 0) return 'explains less than its parameters cost';
  return `explains ${Math.round(behind)} less than the best`;
}

function key(one: { effect: string; joints: readonly number[] }): string {
  return `${one.effect} ${one.joints.join(',')}`;
}
