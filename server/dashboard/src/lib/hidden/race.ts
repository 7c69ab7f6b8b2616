/** Candidates that compete while a diagnosis runs, as bars. Pure. */

import type { Job } from '../api/types';

export interface Runner {
  key: string;
  called: string;
  joint: number | null;
  /** 0 to 1, of the best. */
  width: number;
  evidence: number;
  /** Fitted; else only promised by a probe. */
  fitted: boolean;
  leads: boolean;
}

/** The first `most` candidates with something to say for them, the best first. */
export function runnersOf(leading: Job['leading'], most = 6): Runner[] {
  const ranked = [...(leading ?? [])]
    .filter((one) => one.evidence > 0)
    .sort((one, other) => other.evidence - one.evidence)
    .slice(0, most);
  const best = ranked[0]?.evidence ?? 1;
  return ranked.map((one, place) => ({
    key: `${one.effect} ${one.joints.join(',')}`,
    called: one.called,
    joint: one.joints.length === 1 ? one.joints[0]! : null,
    width: one.evidence / best,
    evidence: one.evidence,
    fitted: one.fitted,
    leads: place === 0,
  }));
}
