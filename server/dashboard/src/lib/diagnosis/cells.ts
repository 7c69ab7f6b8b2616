/** What a cell of the map of disagreement is. */

import type { PhaseCell } from '../api/types';
import { fixed } from '../format';

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
