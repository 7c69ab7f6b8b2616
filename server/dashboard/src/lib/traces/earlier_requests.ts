/** Asks for the figures of earlier runs of the same experiment. */

import { api, ask, here, type TraceDetails } from '../api';
import { COMPARED, isSameExperiment, isWholeRun } from './earlier';

/** Entries that are looked through: the newest before it. */
const LISTED = 50;

/** Figures of the newest whole runs before a trace, of the same experiment on the same arm. Throws a Problem. */
export async function figuresBefore(details: TraceDetails): Promise<TraceDetails['figures'][]> {
  const { entry } = details;
  if (!isWholeRun(entry)) return [];
  const query = {
    source: entry.source,
    outcome: 'complete' as const,
    until: entry.created,
    limit: LISTED,
    ...(entry.kind === null ? {} : { kind: entry.kind }),
  };
  const page = await ask(api.GET('/api/v1/robots/{robot}/traces', { params: { path: here(), query } }));
  const candidates = page.items.filter(
    (one) => one.id !== entry.id && one.name === entry.name && isWholeRun(one) && !one.missing,
  );
  const found: TraceDetails['figures'][] = [];
  for (const { id } of candidates.slice(0, 2 * COMPARED)) {
    if (found.length === COMPARED) break;
    const params = { path: { ...here(), trace: id } };
    const other = await ask(api.GET('/api/v1/robots/{robot}/traces/{trace}', { params }));
    if (isSameExperiment(details, other)) found.push(other.figures);
  }
  return found;
}
