/** Sentences that say why two things on the page of a diagnosis do not contradict each other. */

import type { DiagnosisData, PhaseCell } from '../api/types';
import { fixed } from '../format';
import { candidateName } from './words';

/** Why a residual that goes surely with something is no finding; empty where the diagnosis names one. */
export function whyNotCounted(
  found: Pick<DiagnosisData, 'verdict' | 'steps' | 'significant'>,
  where: { readonly joint: number | null },
): string {
  if (found.verdict !== 'nothing-significant') return '';
  const size =
    where.joint === null
      ? 'σ says how certain the dependence is, not how large: no joint is off by more than noise. '
      : '';
  const [best] = found.steps
    .flatMap((step) => step.candidates)
    .sort((one, other) => other.evidence - one.evidence);
  const nearest =
    best === undefined ? '' : `the best, ${candidateName(best)}, has evidence ${fixed(best.evidence, 0)}`;
  const needed =
    found.significant === null ? '' : `an effect is named from evidence ${fixed(found.significant, 0)} on`;
  const said = [needed, nearest].filter((part) => part !== '').join('; ');
  return `${size}This is not a finding${said === '' ? '' : `: ${said}`}.`;
}

/** What a cell of the map is, beside a sentence about whole phases; empty without a cell. */
export function cellMeaning(cells: readonly PhaseCell[], trace: number, chance: number): string {
  const own = cells.filter((cell) => cell.trace === trace);
  if (own.length === 0) return '';
  const length = Math.max(...own.map((cell) => cell.end - cell.start));
  const quiet = own.filter((cell) => cell.significance <= chance);
  const most = Math.max(0, ...quiet.map((cell) => Math.sqrt(cell.mean_square)));
  const reached =
    quiet.length === 0 ? '' : `; by chance alone it reaches up to ${fixed(most, 1)} times the noise here`;
  return (
    `The sentence above is about all windows of a joint and phase together. A cell is one window of ${fixed(length, 1)} s, ` +
    `or a few neighbouring ones${reached}. Beyond chance: ${own.length - quiet.length} of ${own.length} windows.`
  );
}
