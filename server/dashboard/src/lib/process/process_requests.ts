/** What is asked of the service about gripper and process signals; changing them needs the control. */

import { api, ask, here } from '../api';
import { control } from '../control/control.svelte';
import type { ProcessRequests } from './process.svelte';

export const PROCESS_REQUESTS: ProcessRequests = {
  look: () => ask(api.GET('/api/v1/robots/{robot}/process', { params: { path: here() } })),
  grip(closed) {
    const params = { path: here(), header: control.header() };
    return ask(api.PUT('/api/v1/robots/{robot}/gripper', { params, body: { closed } }));
  },
  set(output, on) {
    const params = { path: { ...here(), output }, header: control.header() };
    return ask(api.PUT('/api/v1/robots/{robot}/process/outputs/{output}', { params, body: { on } }));
  },
};
