/** The layouts that the service keeps for the caller; it has no place for them without the plug-in `layouts`. */

import { api, ask } from '../api';
import { Problem } from '../api/problem';
import type { Keeper } from './layouts.svelte';

const ADDRESS = '/api/v1/me/layouts';

function isMissing(error: unknown): boolean {
  return error instanceof Problem && error.status === 404;
}

export const LAYOUT_REQUESTS: Keeper = {
  async get() {
    try {
      return (await ask(api.GET(ADDRESS))).text || null;
    } catch (error) {
      if (isMissing(error)) return null;
      throw error;
    }
  },
  async put(text) {
    try {
      await ask(api.PUT(ADDRESS, { body: { text } }));
    } catch (error) {
      if (!isMissing(error)) throw error;
    }
  },
};
