/** What is asked of the service about gains; writing them needs the control. */

import { api, ask, here } from '../api';
import { control } from '../control/control.svelte';
import type { GainRequests } from './gains.svelte';

const ADDRESS = '/api/v1/robots/{robot}/gains';

export const GAIN_REQUESTS: GainRequests = {
  read: async () => (await ask(api.GET(ADDRESS, { params: { path: here() } }))).gains,
  async write(gains) {
    const params = { path: here(), header: control.header() };
    return (await ask(api.PUT(ADDRESS, { params, body: { gains: gains as Record<string, number[]> } })))
      .gains;
  },
};
