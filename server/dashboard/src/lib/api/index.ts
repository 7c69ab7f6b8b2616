export { addressOf, api, ask, download, here, readiness } from './client';
export { asProblem, Problem } from './problem';
export type * from './types';
