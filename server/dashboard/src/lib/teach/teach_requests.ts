/** What is asked of the service to teach; all of it needs the control. */

import { api, ask, here } from '../api';
import { control } from '../control/control.svelte';
import type { TeachRequests } from './teaching.svelte';

const params = () => ({ path: here(), header: control.header() });

export const TEACH_REQUESTS: TeachRequests = {
  run: (body) => ask(api.POST('/api/v1/robots/{robot}/teaching/program', { params: params(), body })),
  lead: (joints) =>
    ask(
      api.POST('/api/v1/robots/{robot}/teaching/lead', { params: params(), body: { joints: [...joints] } }),
    ),
  finish: () => ask(api.POST('/api/v1/robots/{robot}/teaching/finish', { params: params() })),
};
