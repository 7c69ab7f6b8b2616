/** Resuming the queue of a mock: that of a real arm wants consent, for which the queue asks. */

import { api, ask, here } from '../api';

export const resumeMock = (): Promise<unknown> =>
  ask(api.POST('/api/v1/robots/{robot}/queue/resume', { params: { path: here() }, body: {} }));
