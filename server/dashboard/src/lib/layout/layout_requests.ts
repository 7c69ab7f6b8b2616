/** The layouts that the service keeps for the caller, where it has the plug-in `layouts`. */

import { api, ask } from '../api';
import type { Keeper } from './layouts.svelte';

const ADDRESS = '/api/v1/me/layouts';

export const LAYOUT_REQUESTS: Keeper = {
  async get() {
    return (await ask(api.GET(ADDRESS))).text || null;
  },
  async put(text, name) {
    await ask(api.PUT(ADDRESS, { body: { text, name } }));
  },
};
