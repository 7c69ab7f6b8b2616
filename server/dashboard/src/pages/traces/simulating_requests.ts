/** What is asked of the service to simulate a trace. */

import { api, ask, here, type Job } from '../../lib/api';
import type { SimulatingRequests } from './simulating.svelte';

/** s that one question waits for the job's end. */
const WAIT = 5;

const at = (job: string): { path: { robot: string; job: string } } => ({ path: { ...here(), job } });

export const SIMULATING_REQUESTS: SimulatingRequests = {
  async begin(trace, model) {
    const body = { kind: 'compare' as const, traces: [trace], models: [model] };
    return (await ask(api.POST('/api/v1/robots/{robot}/jobs', { params: { path: here() }, body }))) as Job;
  },
  async news(job) {
    const params = { ...at(job), query: { wait: WAIT } };
    return (await ask(api.GET('/api/v1/robots/{robot}/jobs/{job}', { params }))) as Job;
  },
  async result(job) {
    return (await ask(api.GET('/api/v1/robots/{robot}/jobs/{job}/result', { params: at(job) }))).data;
  },
  async remove(job) {
    await ask(api.DELETE('/api/v1/robots/{robot}/jobs/{job}', { params: at(job) }));
  },
};
