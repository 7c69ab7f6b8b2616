export { addressOf, api, ask, download, here } from './client';
export { asProblem, Problem } from './problem';
export type * from './types';
