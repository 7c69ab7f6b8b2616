/** A diagnosis saved as one file. `report.html` of the page's build is the program; its data are put into it here. */

import type { DiagnosisData } from '../api/types';

export interface SavedReport {
  headline: string;
  /** When, and by whom. */
  made: string;
  found: DiagnosisData;
  /** What people call the traces. */
  names: Readonly<Record<string, string>>;
}

/** Where the data stand in the program. */
export const DATA = '<script id="data" type="application/json">{}</script>';

/** The file. No text of the data can end its element: every `<` is written as an escape. Raises an Error. */
export function withData(program: string, saved: SavedReport): string {
  if (!program.includes(DATA)) throw new Error('the page was built without its report: build it again');
  const text = JSON.stringify(saved).replaceAll('<', '\\u003c');
  return program.replace(DATA, () => DATA.replace('{}', () => text));
}
