/** What is asked of the service to choose traces. */

import { api, ask, here, type CatalogueEntry } from '../api';

/** Traces that are offered at once. */
const SHOWN = 30;

export async function matchingTraces(text: string): Promise<readonly CatalogueEntry[]> {
  const query = { limit: SHOWN, ...(text === '' ? {} : { q: text }) };
  return (await ask(api.GET('/api/v1/robots/{robot}/traces', { params: { path: here(), query } }))).items;
}
