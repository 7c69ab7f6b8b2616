/** What models are called that are known by their numbers alone. */

import { api, ask, here } from '../api';
import { Names } from '../names/names.svelte';

export const modelNames = new Names(async (id) => {
  const params = { path: { ...here(), model: id } };
  return (await ask(api.GET('/api/v1/robots/{robot}/models/{model}', { params }))).entry.name;
});
