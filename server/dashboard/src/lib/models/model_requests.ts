/** What is asked of the service about one model. */

import { api, ask, download, here } from '../api';
import { JOB_REQUESTS } from '../jobs/job_requests';
import type { ModelRequests } from './opened_model.svelte';

const pathOf = (model: string) => ({ path: { ...here(), model } });

export const MODEL_REQUESTS: ModelRequests = {
  ofMachine: () =>
    ask(api.GET('/api/v1/robots/{robot}/models/machine/parameters', { params: { path: here() } })),
  model: (id) => ask(api.GET('/api/v1/robots/{robot}/models/{model}', { params: pathOf(id) })),
  result: (job) => JOB_REQUESTS.result(job),
  remove: (id) => ask(api.DELETE('/api/v1/robots/{robot}/models/{model}', { params: pathOf(id) })),
  save: (id) => download(`/models/${id}/model.json`, `${id}.json`),
};
