/** What is asked of the service to teach; what moves the arm needs the control. */

import { api, ask, here } from '../api';
import { control } from '../control/control.svelte';
import type { TeachRequests } from './teaching.svelte';

const params = () => ({ path: here(), header: control.header() });

const PROGRAM = '/api/v1/robots/{robot}/programs/{program}';
const at = (program: string) => ({ path: { ...here(), program } });

export const TEACH_REQUESTS: TeachRequests = {
  list: () => ask(api.GET('/api/v1/robots/{robot}/programs', { params: { path: here() } })),
  load: (name) => ask(api.GET(PROGRAM, { params: at(name) })),
  put: (name, body, revision) =>
    ask(api.PUT(PROGRAM, { params: { ...at(name), query: { revision } }, body })),
  async remove(name) {
    await ask(api.DELETE(PROGRAM, { params: at(name) }));
  },
  run: (body) => ask(api.POST('/api/v1/robots/{robot}/teaching/program', { params: params(), body })),
  lead: (joints) =>
    ask(
      api.POST('/api/v1/robots/{robot}/teaching/lead', { params: params(), body: { joints: [...joints] } }),
    ),
  finish: () => ask(api.POST('/api/v1/robots/{robot}/teaching/finish', { params: params() })),
};
