/** The maps of disagreement that a diagnosis has: of the model as it was given, and before every step. */

import type { DiagnosisData, DiagnosisStep } from '../api/types';

export interface WhereView {
  name: string;
  where: DiagnosisStep['where'];
  /** Significance beyond which a window counts. */
  chance: number;
  /** Why its dependences are no finding; empty where they are one. */
  not_a_finding: string;
}

/** In the order in which they came; those without a map are left out. */
export function viewsOf(found: Pick<DiagnosisData, 'given' | 'steps'>): WhereView[] {
  const steps = found.steps.map((step) => ({
    name: `tolerances fitted, before ${step.called}`,
    where: step.where,
    chance: step.chance,
    not_a_finding: step.not_a_finding,
  }));
  const given = found.given === null ? [] : [{ name: 'the model as given', ...found.given }];
  return [...given, ...steps].filter((view) => view.where.cells.length > 0);
}
