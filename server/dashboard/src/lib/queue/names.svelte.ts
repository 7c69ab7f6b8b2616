/** What experiments are called and do that are known by their numbers alone. */

import { api, ask, here } from '../api';
import { Names } from '../names/names.svelte';
import { motionOf } from '../trajectory/words';

type Spec = { name: string | null; trajectory: { kind: string } };
const named = (words: (spec: Spec) => string): Names =>
  new Names(async (id) => {
    const params = { path: { ...here(), experiment: id } };
    return words((await ask(api.GET('/api/v1/robots/{robot}/experiments/{experiment}', { params }))).spec);
  });

export const experimentNames = named((spec) => spec.name ?? spec.trajectory.kind.replaceAll('_', ' '));
/** What they do, in a few words. */
export const experimentMotions = named((spec) => motionOf(spec.trajectory));
