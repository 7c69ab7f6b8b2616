/** What experiments are called that are known by their numbers alone. */

import { api, ask, here } from '../api';
import { Names } from '../names/names.svelte';

export const experimentNames = new Names(async (id) => {
  const params = { path: { ...here(), experiment: id } };
  const { spec } = await ask(api.GET('/api/v1/robots/{robot}/experiments/{experiment}', { params }));
  return spec.name ?? spec.trajectory.kind.replaceAll('_', ' ');
});
