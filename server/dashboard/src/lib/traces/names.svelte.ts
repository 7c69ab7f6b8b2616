/** What traces are called that are known by their numbers alone. */

import { api, ask, here } from '../api';
import { Names } from '../names/names.svelte';
import { traceLabel } from './label';

export const traceNames = new Names(async (id) => {
  const params = { path: { ...here(), trace: id } };
  const { entry } = await ask(api.GET('/api/v1/robots/{robot}/traces/{trace}', { params }));
  return traceLabel(entry);
});
