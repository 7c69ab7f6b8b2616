export { addressOf, api, ask, download, here, newKey, pageOf, readiness, root, saveAs } from './client';
export { asProblem, Problem } from './problem';
export type * from './types';
