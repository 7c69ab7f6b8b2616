/** What is asked of the service about one job. */

import { api, ask, download, here, type Job } from '../api';
import type { JobRequests, JobResult } from './opened.svelte';

export const JOB_REQUESTS: JobRequests = {
  async job(id) {
    const params = { path: { ...here(), job: id } };
    return (await ask(api.GET('/api/v1/robots/{robot}/jobs/{job}', { params }))) as Job;
  },
  async result(id): Promise<JobResult> {
    const params = { path: { ...here(), job: id } };
    return ask(api.GET('/api/v1/robots/{robot}/jobs/{job}/result', { params }));
  },
  save: download,
};
